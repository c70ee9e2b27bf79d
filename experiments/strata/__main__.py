"""`auto` and others beside a fit of the true effects, by stratum of effects and cycles in training.

Run ``python -m experiments.strata``; it writes ``results.json`` and ``results.md`` beside itself.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from experiments.results import write_results
from experiments.strata.units import AVERAGING_S, STRATA, case, oracle, recorded
from experiments.synthetic_world import World, cycle
from fogml import __version__
from fogml.models.names import make_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.validation.judge import judge

HERE = Path(__file__).parent
MODELS = ("auto", "mixed-effects", "polynomial")
CYCLES = (1, 2, 3)
SEEDS = range(100, 102)


def strata(seeds: range) -> list[dict]:
    """One entry for each unit and model: rms on the test run over that of the oracle, and coverage."""
    rows = []
    for stratum in STRATA:
        for cycles in CYCLES:
            for seed in seeds:
                train, test = case(stratum, cycles, seed)
                best = oracle(train, test)
                for name in MODELS:
                    model = make_model(name).fit(recorded(train))
                    judged = judge(model, recorded(train), recorded(test), averaging_s=AVERAGING_S).test[0]
                    place = {"stratum": stratum, "cycles": cycles, "seed": seed, "model": name}
                    covered = float(np.mean(np.abs(judged.series.after) <= judged.series.upper))
                    told = {"rms": judged.after.rms, "oracle": best, "coverage": covered}
                    rows.append({**place, **told, "before": judged.before.rms})
                print(
                    stratum,
                    cycles,
                    seed,
                    {r["model"]: round(r["rms"] / best, 2) for r in rows[-3:]},
                    flush=True,
                )
    return rows


def light_run(seed: int, rate: float) -> Run:
    """Hysteresis and the source's optical power in the truth: 1 Hz, white noise of 0.3 deg/h a sample."""
    rng = np.random.default_rng(seed)
    T = cycle(rate, 1.0)
    time_s = np.arange(float(len(T)))
    play = np.empty(len(T))
    state = T[0]
    for i, t in enumerate(T):
        state = min(max(state, t - 6.0), t + 6.0)
        play[i] = state
    light = 300.0 + 15.0 * np.sin(time_s / 2500.0 + seed) + 5.0 * np.sin(time_s / 700.0)
    drift = 0.01 * T + 1e-4 * T**2 + 0.03 * (play - T) + 0.02 * (light - 300.0)
    noise = rng.normal(0.0, 0.3, len(T))
    columns = {"time": time_s, "gyro": drift + noise, "T": T, "optical_power": light, "drift": drift}
    return Run(f"light-{seed}", columns, Facts(unit="synthetic", axis="x", notes="synthetic"))


def light() -> dict[str, float]:
    """Bias stability left on another run, and that of the noise realised in it [deg/h]."""
    train, test = light_run(1, 1.0), light_run(2, 0.8)
    features = "T^1..3, hysteresis(T), optical_power"
    width = round(AVERAGING_S)
    count = len(test) // width * width
    noise = (test.gyro - test.columns["drift"])[:count].reshape(-1, width).mean(axis=1)
    found = {"the noise itself": float(noise.std())}
    for name, text in (("auto, T alone", None), ("auto of features stated", features)):
        model = make_model("auto", text).fit(train)
        found[name] = judge(model, train, test, averaging_s=AVERAGING_S).test[0].after.bias_stability
    return found


def seconds() -> float:
    """Processor time of a fit of `auto` to 10 h at 1 Hz [s], the second of two fits."""
    run, _ = World().run(cycle(1.0, 1.0, 10.0), 1.0, 0, "ten-hours.csv")
    make_model("auto").fit(run)
    start = time.process_time()
    make_model("auto").fit(run)
    return time.process_time() - start


def page(rows: list[dict], made: dict[str, float], fit_s: float) -> str:
    """The result page."""
    lines = ["| effects | cycles | " + " | ".join(MODELS) + " | no compensation | coverage of `auto` |"]
    lines.append("|---|---:|" + "---:|" * (len(MODELS) + 2))
    for stratum in STRATA:
        for cycles in CYCLES:
            found = [r for r in rows if (r["stratum"], r["cycles"]) == (stratum, cycles)]
            own = {m: [r for r in found if r["model"] == m] for m in MODELS}
            cells = [_mean([r["rms"] / r["oracle"] for r in own[m]]) for m in MODELS]
            none = _mean([r["before"] / r["oracle"] for r in own["auto"]])
            covered = np.mean([r["coverage"] for r in own["auto"]])
            lines.append(f"| {stratum} | {cycles} | {' | '.join(cells)} | {none} | {covered:.2f} |")
    units = len({r["seed"] for r in rows})
    left = "\n".join(f"| {name} | {value:.4f} |" for name, value in made.items())
    return f"""# `auto` beside a fit of the true effects

Data: **synthetic**, {units} tactical units in each line drawn by `experiments/strata/units.py`, on which
nothing was tuned. Training: 30 min at 25 °C after power-on, then one to three cycles from −40 to 60 °C at 1,
0.5 and 2 °C/min with soaks of an hour; test: a cycle from −35 to 55 °C at 0.7 or 1.5 °C/min with soaks of
90 min, from another power-on. rms of {AVERAGING_S:.0f} s averages on the test run, bias and noise included,
over that of the *oracle*: least squares of the true effects' own courses and the nominal terms. Geometric
means. fogml {__version__}; `python -m experiments.strata`.

{chr(10).join(lines)}

## Hysteresis and optical power in the truth

A made run of 1 Hz: a play of 6 °C, the source's optical power, a quadratic in T, white noise; trained at
1 °C/min, judged at 0.8 °C/min. Bias stability of {AVERAGING_S:.0f} s averages [deg/h]:

| model | left |
|---|---:|
{left}

## Time

A fit of `auto` to 10 h at 1 Hz takes {fit_s:.1f} s of one processor.
"""


def _mean(ratios: list[float]) -> str:
    return f"{np.exp(np.mean(np.log(ratios))):.2f}"


def main(seeds: range = SEEDS) -> None:
    """Compute and write the results."""
    made, fit_s = light(), seconds()
    print(made, fit_s, flush=True)
    rows = strata(seeds)
    result = {"strata": rows, "light": made, "fit_s": fit_s}
    write_results(HERE, result, page(rows, made, fit_s))


if __name__ == "__main__":
    main()
