"""A twin on a rate table: the programmes whose runs tell what a laboratory tests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.numerals import ascii_number
from fogml.runs.facts import Direction, Facts
from fogml.runs.run import Run
from fogml.twin.noise import NoiseConstants
from fogml.twin.programme import Programme
from fogml.twin.set_up import Sensors
from fogml.twin.simulate import simulate
from fogml.twin.steps import Hold, Oscillate, Soak, Turn
from fogml.twin.twin import Twin

FACTS = Facts(latitude=39.9, input_axis="east", table_axis=Direction(heading=90.0))
"""The input axis to the east, and the table about it: no Earth rate, so that zero is zero."""
SAMPLE_S, SOAK_SAMPLE_S = 1.0, 10.0
STAY_S, SOAK_STAY_S = 60.0, 300.0
"""On each rate of a ladder, and of a soak's turns [s]."""
ACCELERATION_DEG_S2 = 1e5
"""Of the test's table: a flank is over within a sample."""
SMALL_DEG_H = tuple(float(f"{m}e{e}") for e in range(-3, 2) for m in (1, 2, 5))
"""Rates about zero, and steps on top of a carrier [deg/h]: 0.001 to 50."""
CARRIER_SHARE = 0.05
"""Of the greatest rate: what the small steps come on top of."""
CYCLES = 40
"""Of each oscillation."""
POINTS_A_CYCLE = 256
OSCILLATION_DEG_S = 1.0
FLANK_S, FLANK_SAMPLE_S = 0.25, 1e-5
"""Length and samples of the step of the slew test [s]."""
FLANK_SHARE = 0.2
"""Of the greatest rate: what that step goes to."""
SOAKS_DEGC = (-40.0, -10.0, 25.0, 60.0)
SOAK_S = 6.0 * 3600.0
"""In each temperature: long enough for the whole unit to have it."""


def rate_runs(
    twin: Twin,
    *,
    greatest_deg_s: float = 500.0,
    frequencies_hz: FloatArray | None = None,
    noise: bool = False,
    seed: int = 0,
) -> list[Run]:
    """The runs of a twin's rate tests, synthetic.

    Parameters
    ----------
    twin
        The twin; a unit that has been on for long, in still air at 25 degC but for the temperatures' run.
    greatest_deg_s
        Greatest rate of the ladder [deg/s].
    frequencies_hz
        Of the oscillations [Hz]; 1 Hz to 10 kHz if None.
    noise
        Whether the gyro and its thermometers are noisy; without, its effects alone answer.
    seed
        Of noise.

    Returns
    -------
    list of Run
        Ladder of rates, ladder about zero, small steps on a carrier, turns at several temperatures, one
        oscillation after the other, each sampled for its frequency, and a step of the rate.
    """
    if not noise:
        twin = replace(twin, noise=NoiseConstants(), sensors=Sensors())
        random = [declared.id for declared, _ in twin.random]
        twin = twin.without_effect(*random)
    frequencies = np.logspace(0.0, 4.0, 13) if frequencies_hz is None else frequencies_hz
    shares = np.array([0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
    ladder = greatest_deg_s * shares
    small = np.array(SMALL_DEG_H) / 3600.0
    # Where the output is zero, which is where a dead zone lies.
    zero = -float(_run(twin, "at rest", (Hold(STAY_S),), SAMPLE_S, seed).gyro_deg_h.mean()) / 3600.0
    carrier = CARRIER_SHARE * greatest_deg_s
    carried = [rate for step in small for rate in (carrier, carrier + step)]
    programmes: list[tuple[str, tuple[Hold | Soak, ...], float]] = [
        ("rates", _turns([rate for r in ladder for rate in (r, -r)]), SAMPLE_S),
        ("about zero", _turns([zero + rate for r in small for rate in (0.0, r, 0.0, -r)]), SAMPLE_S),
        ("steps on a carrier", _turns(carried), SAMPLE_S),
        ("temperatures", _soaks(), SOAK_SAMPLE_S),
    ]
    runs = [_run(twin, name, steps, sample, seed) for name, steps, sample in programmes]
    for hertz in frequencies.tolist():
        step = Hold(CYCLES / hertz, (Oscillate(OSCILLATION_DEG_S, hertz, CYCLES / hertz),))
        runs.append(_run(twin, f"{ascii_number(hertz, 4)} Hz", (step,), 1.0 / (POINTS_A_CYCLE * hertz), seed))
    turn = Turn(((FLANK_SHARE * greatest_deg_s, None),), 0.1 * FLANK_S)
    return [*runs, _run(twin, "step", (Hold(FLANK_S, (turn,)),), FLANK_SAMPLE_S, seed)]


def _turns(rates: list[float]) -> tuple[Hold, ...]:
    """One turn after the other at each rate, between rests."""
    turn = Turn(tuple((rate, STAY_S) for rate in rates), STAY_S)
    return (Hold(STAY_S * (len(rates) + 2), (turn,)),)


def _soaks() -> tuple[Soak, ...]:
    turn = Turn(((10.0, SOAK_STAY_S), (-10.0, SOAK_STAY_S)), SOAK_S - 3.0 * SOAK_STAY_S)
    return tuple(Soak(temperature, SOAK_S, (turn,)) for temperature in SOAKS_DEGC)


def _run(twin: Twin, name: str, steps: tuple[Hold | Soak, ...], sample_s: float, seed: int) -> Run:
    programme = Programme(steps, table_acceleration=ACCELERATION_DEG_S2, name=name)
    return simulate(
        programme, twin.named(name), sample_s=sample_s, seed=seed, facts=FACTS, columns=("T_in", "rate")
    ).run
