/*
 * A unit that runs for days: a thermometer in steps of 1/256 degC with noise, at 100 Hz, through exported C.
 * Built for a Cortex-M4 it reports through the debugger (semihosting), elsewhere through the C library; both
 * report the same characters, as the temperatures are whole numbers and the C gives the same bits everywhere.
 */
#include "fogml_model.h"
#include "report.h"

#define STEP_US 10000U
#define HOUR (UINT32_C(3600) * UINT32_C(100)) /* [samples] */

static uint32_t seed = 2463534242U;

/* Marsaglia's xorshift. */
static uint32_t drawn(void)
{
    seed ^= seed << 13;
    seed ^= seed >> 17;
    seed ^= seed << 5;
    return seed;
}

/* A triangle of a period, from 0 to its height and back [steps of 1/256 degC]. */
static int32_t triangle(uint32_t sample, uint32_t period, int32_t height)
{
    const uint32_t half = period / 2U;
    const uint32_t at = sample % period;
    const uint32_t away = at < half ? at : period - at;
    return (int32_t)(((uint64_t)away * (uint64_t)height) / half);
}

int main(void)
{
    static fogml_state state;
    uint64_t time_us = UINT64_C(1764000000000000); /* Unix time */
    uint32_t check = 2166136261U;
    uint32_t flags[3] = {0U, 0U, 0U};
    uint32_t sample;

    if (fogml_self_test() != 0) {
        report("self-test failed", 0U);
        return 1;
    }
    fogml_init(&state);
    for (sample = 0; sample < SAMPLES; sample++) {
        /* A day's course, hours of load, minutes of a fan. */
        const int32_t steps = 256 * 8 + triangle(sample, 24U * HOUR, 256 * 24) + triangle(sample, 3U * HOUR, 256 * 6)
                              + triangle(sample, HOUR / 10U, 256) + (int32_t)(drawn() % 5U) - 2;
        float temperatures[FOGML_TEMPERATURES] = {(float)steps * (1.0F / 256.0F)};
        union {
            float value;
            uint8_t bytes[4];
        } out;
        int flag;
        int i;
        if (sample % HOUR == HOUR / 2U) {
            temperatures[0] = 85.0F; /* a thermometer that starts anew */
        }
        flag = fogml_step(&state, (fogml_time)time_us, temperatures, 0.0F, &out.value);
        flags[flag]++;
        for (i = 0; i < 4; i++) {
            check = (check ^ out.bytes[i]) * 16777619U;
        }
        check = (check ^ (uint32_t)flag) * 16777619U;
        time_us += STEP_US;
    }
    report("samples", sample);
    report("flag 0", flags[0]);
    report("flag 1", flags[1]);
    report("flag 2", flags[2]);
    report("checksum of outputs and flags", check);
    return 0;
}
