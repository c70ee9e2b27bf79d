"""A thousand simulated months of units in service: false alarms, delays, causes and sizes.

Run ``python -m experiments.monitoring``; it writes ``results.json`` and ``results.md`` beside itself. Each
month is a unit of its own: a model trained on two runs, then a run a day for 30 days, all of what ``fogml
monitor`` does with them. Synthetic: drift linear in temperature and its rate, white and flicker noise.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from experiments.results import write_results
from fogml import __version__
from fogml.blind.scoring.statistics import wilson
from fogml.models.base import DriftModel
from fogml.models.names import make_model
from fogml.monitor.record import RunRecord, record_run
from fogml.monitor.watch import watch
from fogml.runs.facts import Facts
from fogml.runs.run import FloatArray, Run
from fogml.signals.random_noise import flicker_noise, white_noise

HERE = Path(__file__).parent
RUNS, CHANGED_AT = 30, 15
SAMPLE_S, ROWS = 20.0, 270
TURN_ON = 0.01
"""Deviation of the bias from run to run [deg/h]."""
LIMITS = (100.0, 300.0, 1000.0)
STEADY = {
    "independent": "bias of each run normal about its mean",
    "heavy tails": "bias of each run of Student's t with 3 degrees of freedom",
    "wandering": "bias of the runs as flicker noise",
}
CHANGES = {
    "bias, 3 deviations": ("level", 0.03),
    "bias, 10 deviations": ("level", 0.1),
    "ageing, 1 deviation a day": ("level", 0.01),
    "slope against temperature": ("temperature_slope", 0.002),
    "noise, half as much again": ("scatter", 1.5),
}


def month(kind: str, seed: int) -> list[RunRecord]:
    """Records of a unit's 30 runs."""
    rng = np.random.default_rng((71, seed, len(kind)))
    constants = rng.normal(size=3) * (1.0, 0.02, 0.2)
    model = make_model("polynomial", "T, dT", 0, {})
    model.fit([_run(rng, constants, TURN_ON * rng.normal(), kind="", day=-2 + n) for n in range(2)])
    turn_on = {
        "heavy tails": lambda: TURN_ON * rng.standard_t(3, RUNS) / np.sqrt(3.0),
        "wandering": lambda: flicker_noise(rng, RUNS, TURN_ON),
    }.get(kind, lambda: TURN_ON * rng.normal(size=RUNS))()
    return [_record(rng, model, constants, float(turn_on[day]), kind, day) for day in range(RUNS)]


def _record(
    rng: np.random.Generator, model: DriftModel, constants: FloatArray, bias: float, kind: str, day: int
) -> RunRecord:
    return replace(record_run(model, [_run(rng, constants, bias, kind, day)]), key=f"{kind} {day}")


def _run(rng: np.random.Generator, constants: FloatArray, bias: float, kind: str, day: int) -> Run:
    """A run of 90 min: temperature to and fro through 40 degC from a place of its own."""
    time = SAMPLE_S * np.arange(ROWS)
    temperature = 20.0 + 5.0 * rng.normal() + 20.0 * np.sin(2 * np.pi * (time / time[-1] + rng.uniform()))
    rate = 60.0 * np.gradient(temperature, time)
    figure, size = CHANGES.get(kind, ("", 0.0))
    size *= day >= CHANGED_AT
    noise = white_noise(rng, ROWS, SAMPLE_S, 0.002) + flicker_noise(rng, ROWS, 0.003)
    drift = constants @ np.stack([np.ones(ROWS), temperature, rate]) + bias
    if figure == "level":
        drift += size * (day - CHANGED_AT + 1 if "ageing" in kind else 1.0)
    elif figure == "temperature_slope":
        drift += size * (temperature - 20.0)
    elif figure == "scatter" and size:
        noise *= size
    started = datetime(2026, 1, 5, tzinfo=UTC) + timedelta(days=day)
    return Run.from_columns(
        f"{day}", Facts(unit="synthetic", started=started), time=time, gyro=drift + noise, T=temperature
    )


def steady(months: int) -> list[dict]:
    """Months without a change: false alarms by limit."""
    rows = []
    for kind in STEADY:
        count = months if kind == "independent" else months // 2
        alarms = dict.fromkeys(LIMITS, 0)
        for seed in range(count):
            records = month(kind, seed)
            for limit in LIMITS:
                (unit,) = watch(records, runs_between_false_alarms=limit)
                alarms[limit] += bool(unit.chart.changes)
        for limit in LIMITS:
            rows.append({"kind": kind, "months": count, "limit": limit, "alarms": alarms[limit]})
    return rows


def changed(months: int, limit: float = 1000.0) -> list[dict]:
    """Months with a change with the sixteenth run: what is found of it."""
    rows = []
    for kind, (figure, size) in CHANGES.items():
        early = found = right = onset = covered = 0
        delays = []
        for seed in range(months):
            (unit,) = watch(month(kind, seed), runs_between_false_alarms=limit)
            first = unit.chart.changes[0] if unit.chart.changes else None
            if first is None:
                continue
            if first.raised_at < CHANGED_AT:
                early += 1
                continue
            found += 1
            delays.append(first.raised_at - CHANGED_AT + 1)
            right += int(first.figure == figure)
            onset += int(first.onset_ci90[0] <= CHANGED_AT <= first.onset_ci90[1])
            expected = np.log(size) if figure == "scatter" else size
            covered += int(first.size_ci90[0] <= expected <= first.size_ci90[1])
        row = {"kind": kind, "months": months, "found": found, "early": early, "right": right}
        rows.append({**row, "onset": onset, "size": covered, "delays": delays})
    return rows


def page(no_change: list[dict], change: list[dict]) -> str:
    """The result page."""
    total = sum(row["months"] for row in no_change if row["limit"] == LIMITS[0])
    total += sum(row["months"] for row in change)
    lines = [
        "# Units in service: alarms over simulated months",
        "",
        f"fogml {__version__}; synthetic, {total} months of {RUNS} runs of 90 min, each a unit of its own "
        f"with a model trained on two runs; between runs the bias moves by {TURN_ON} deg/h. The limits were "
        "not tuned: they are the stated runs between false alarms. 95 % intervals by Wilson.",
        "",
        "## Nothing changes",
        "",
        "| from run to run | limit | months | months with a false alarm, stated at most | found |",
        "|---|---:|---:|---:|---:|",
    ]
    for row in no_change:
        lines.append(
            f"| {STEADY[row['kind']]} | {row['limit']:g} | {row['months']} | "
            f"{min(RUNS / row['limit'], 1):.0%} | "
            f"{_share(row['alarms'], row['months'])} |"
        )
    lines += [
        "",
        "With every figure normal and independent the limit holds. Here it does not: temperature takes "
        "another course on each run, so that slopes and scatter are told now well, now badly, and what is "
        "badly told passes for a change. At a limit of 1000, months with a false alarm are five times as "
        "many as stated, with a bias that wanders ten times.",
        "",
        f"## Something changes with run {CHANGED_AT + 1}, limit 1000",
        "",
        "| change | months | found by run 30 | runs until noticed, median (9 in 10 within) | false before | "
        "figure right | true run among those of 90 % | true size in its 90 % interval |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in change:
        delays = np.array(row["delays"] or [np.nan])
        lines.append(
            f"| {row['kind']} | {row['months']} | {_share(row['found'], row['months'])} | "
            f"{np.median(delays):.0f} ({np.quantile(delays, 0.9):.0f}) | {row['early']} | "
            f"{_share(row['right'], row['found'])} | {_share(row['onset'], row['found'])} | "
            f"{_share(row['size'], row['found'])} |"
        )
    lines += [
        "",
        "The size is that at the moment of the alarm: what is noticed early is noticed because it looked "
        "large.",
        "",
    ]
    return "\n".join(lines)


def _share(count: int, of: int) -> str:
    if not of:
        return "–"
    told = wilson(count, of)
    return f"{count} of {of} ({told.low:.0%} … {told.high:.0%})"


def main() -> None:
    """Simulate, judge and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--months", type=int, default=400, help="months of the first kind (400)")
    given = parser.parse_args()
    no_change = steady(given.months)
    change = changed(max(given.months // 10, 1))
    write_results(HERE, {"steady": no_change, "changed": change}, page(no_change, change))


if __name__ == "__main__":
    main()
