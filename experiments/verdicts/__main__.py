"""Does a verdict hold on the next run? Synthetic units: trained on a run, judged on another, used on a third.

``python -m experiments.verdicts`` writes ``results.json`` and ``results.md``. Plain NumPy makes the runs, and
nothing of fogml but their type.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter

from experiments.results import write_results
from fogml.arrays import FloatArray
from fogml.blind.scoring.statistics import wilson
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.validation.advice import advice_on
from fogml.validation.judge import judge

HERE = Path(__file__).parent
SAMPLE_S = 10.0
FIRST_SEED = 5000
PROGRAMMES = {
    "one range": "soaks and ramps of 0.5 to 2 degC/min between -35 and 65 degC; training goes to both ends",
    "any": "soaks and ramps of 0.3 to 2 degC/min to temperatures drawn anew for each run",
}
RATES_DEGC_MIN = {"one range": [0.5, 1.0, 2.0], "any": [0.3, 0.5, 1.0, 2.0]}
GRADES = {"use": "use", "use_with_care": "use with care", "do_not_use": "do not use"}


def chamber(rng: np.random.Generator, programme: str, trains: bool) -> FloatArray:
    """Air [degC] of a run of 6 to 9 h, from 25 degC on."""
    count = int(rng.uniform(6.0, 9.0) * 3600.0 / SAMPLE_S)
    time, air = [0.0], [25.0]
    ends = [65.0, -35.0] if programme == "one range" and trains else []
    while time[-1] < SAMPLE_S * count:
        rate = rng.choice([1.0, 2.0] if ends else RATES_DEGC_MIN[programme])
        target = ends.pop() if ends else rng.uniform(-35.0, 65.0)
        time += [time[-1] + rng.uniform(1200.0, 4000.0)]
        time += [time[-1] + 60.0 * abs(target - air[-1]) / rate]
        air += [air[-1], target]
    return np.interp(SAMPLE_S * np.arange(count), time, air)


def lagged(values: FloatArray, time_constant_s: float) -> FloatArray:
    """A first-order lag that begins at rest."""
    keep = np.exp(-SAMPLE_S / time_constant_s)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values - values[0]) + values[0])


def play(values: FloatArray, half_width: float) -> FloatArray:
    """What a play of a half width lags behind its input."""
    out = np.empty_like(values)
    held = float(values[0])
    for i, value in enumerate(values.tolist()):
        held = min(max(held, value - half_width), value + half_width)
        out[i] = held - value
    return out


def unit(rng: np.random.Generator) -> dict[str, Any]:
    """What a unit is: a cubic of the coil's temperature, a rate, a play, noise, shifts at power-on."""
    return {
        "cubic": rng.normal(size=3) * [1.0, 0.5, 0.3] * rng.choice([0.05, 0.3, 1.0]),
        "lag_s": rng.uniform(300.0, 1500.0),
        "rate": 0.1 * rng.normal() * rng.choice([0, 1]),
        "rate_lag_s": rng.uniform(60.0, 600.0),
        "play": 0.05 * rng.normal() * rng.choice([0, 0, 1]),
        "half_width": rng.uniform(3.0, 15.0),
        "N": rng.choice([5e-4, 2e-3, 5e-3]),
        "K": rng.choice([0.0, 0.01, 0.05]),
        "power_on": rng.choice([0.0, 0.01, 0.05]),
        "sensor_share": rng.uniform(0.7, 1.3),
    }


def recorded(rng: np.random.Generator, of: dict[str, Any], air: FloatArray, name: str) -> Run:
    """A run of a unit: its output [deg/h], the coil's thermometer with a lag of its own, the air's."""
    coil = lagged(air, of["lag_s"])
    u = (coil - 25.0) / 50.0
    drift = of["cubic"] @ np.array([u, u**2, u**3])
    drift += of["rate"] * lagged(60.0 * np.gradient(coil, SAMPLE_S), of["rate_lag_s"])
    drift += of["play"] * play(coil, of["half_width"]) / of["half_width"]
    hours = SAMPLE_S / 3600.0
    white = of["N"] / np.sqrt(hours) * rng.standard_normal(len(air))
    walk = np.cumsum(of["K"] * np.sqrt(hours) * rng.standard_normal(len(air)))
    gyro = 9.0 + drift + white + walk + of["power_on"] * rng.standard_normal()
    inner = lagged(air, of["sensor_share"] * of["lag_s"]) + 0.01 * rng.standard_normal(len(air))
    outer = air + 0.02 * rng.standard_normal(len(air))
    columns = {"gyro": gyro, "T_in": np.round(inner, 2), "T_out": np.round(outer, 2)}
    return Run.from_columns(name, time=SAMPLE_S * np.arange(len(air)), **columns)


def one(seed: int, programme: str) -> dict[str, Any]:
    """A unit's verdict, and what the third run says to it."""
    rng = np.random.default_rng(seed)
    of = unit(rng)
    runs = [recorded(rng, of, chamber(rng, programme, i == 0), f"run {i + 1}") for i in range(3)]
    model = make_model("auto").fit(runs[0])
    advice = advice_on(judge(model, runs[0], runs[1]))
    (third,) = judge(model, runs[0], runs[2]).test
    return {
        "seed": seed,
        "programme": programme,
        "grade": advice.grade,
        "brief": advice.brief,
        "rms": [third.before.rms, third.after.rms],
        "bias_stability": [third.before.bias_stability, third.after.bias_stability],
        "floor": third.floor,
    }


def page(rows: list[dict[str, Any]], first: int) -> str:
    """The result page."""
    lines = [
        "# Does a verdict hold on the next run?",
        "",
        f"**Synthetic**, own simulation, seeds from {first} on: `auto` trained on a run, judged on a second, "
        "then used on a third, which nothing has seen. Drift is large, small or hardly there, beside noise "
        "and shifts from power-on to power-on of three sizes each, so that some units no model can help. "
        "Shares with 95 % intervals (Wilson).",
        "",
        "| programmes | verdict | units | rms lower on the third | bias stability lower | at most half |",
        "|---|---|---:|---:|---:|---:|",
    ]
    for programme in PROGRAMMES:
        for grade, words in GRADES.items():
            of = [r for r in rows if r["programme"] == programme and r["grade"] == grade]
            shares = [
                _share([r[name][1] < most * r[name][0] for r in of])
                for name, most in (("rms", 1.0), ("bias_stability", 1.0), ("bias_stability", 0.5))
            ]
            lines.append(f"| {programme} | {words} | {len(of)} | {' | '.join(shares)} |")
    lines += ["", *(f"- **{name}**: {told}." for name, told in PROGRAMMES.items())]
    return "\n".join(lines) + "\n"


def _share(held: list[bool]) -> str:
    if not held:
        return "–"
    share = wilson(sum(held), len(held))
    return f"{share.value:.0%} ({share.low:.0%} … {share.high:.0%})"


def main() -> None:
    """Make and judge the units; write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=100, help="of each kind of programmes (100)")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help=f"first seed ({FIRST_SEED})")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of the results")
    given = parser.parse_args()
    rows = [one(given.first + i, programme) for programme in PROGRAMMES for i in range(given.units)]
    write_results(given.out, rows, page(rows, given.first))


if __name__ == "__main__":
    main()
