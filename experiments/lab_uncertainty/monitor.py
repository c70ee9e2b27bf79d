"""Units in service: figures of a run, false alarms, and sizes of changes against true ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import Told, coverage, of_interval, share
from experiments.lab_uncertainty.signals import flicker
from fogml.arrays import FloatArray
from fogml.monitor.changes import change_chart

LIMIT, RUNS = 300.0, 40


@dataclass(frozen=True)
class Months:
    """Runs of a unit: what moves its figure between them, and what changes with run `onset`.

    Deviations between runs: white, flicker, a walk, a season (amplitude, 52 runs a year), and the tails of a
    Student's t with `freedom`, 0 for normal ones; the eighth run alone is off by `bad_run`; each run tells
    its figure with an error of the deviation `error`, stated right. So many `figures` are watched. The change
    is a step or, per run, a ramp, of the given size either way.
    """

    white: float = 1.0
    flicker: float = 0.0
    walk: float = 0.0
    season: float = 0.0
    freedom: int = 0
    bad_run: float = 0.0
    error: float = 0.5
    shape: str = ""
    size: float = 0.0
    onset: int = 20
    figures: int = 1


CASES = {
    "nothing changes, white": Months(),
    "nothing changes, flicker": Months(flicker=1.0),
    "nothing changes, tails": Months(freedom=3),
    "nothing changes, tails of all four figures": Months(freedom=3, error=0.2, figures=4),
    "nothing changes, random walk": Months(walk=0.1),
    "nothing changes, season of amplitude 1": Months(season=1.0),
    "nothing changes, season of amplitude 3": Months(season=3.0),
    "nothing changes, one run 30 off": Months(bad_run=30.0),
    "nothing changes, flicker, one run 30 off": Months(flicker=1.0, bad_run=30.0),
    "step of 3": Months(shape="step", size=3.0),
    "step of 6": Months(shape="step", size=6.0),
    "step of 12": Months(shape="step", size=12.0),
    "step of 12 after one run 30 off": Months(shape="step", size=12.0, bad_run=30.0),
    "step of 12 on flicker": Months(flicker=1.0, shape="step", size=12.0),
    "ramp of 0.5 a run": Months(shape="ramp", size=0.5),
    "ramp of 1 a run": Months(shape="ramp", size=1.0),
    "ramp of 1 a run on flicker": Months(flicker=1.0, shape="ramp", size=1.0),
}


def recorded(months: Months, rng: np.random.Generator) -> tuple[FloatArray, FloatArray, float]:
    """Levels and their standard errors, and the true size of the change."""
    white = rng.standard_t(months.freedom, RUNS) if months.freedom else rng.standard_normal(RUNS)
    level = months.white * white + months.walk * np.cumsum(rng.standard_normal(RUNS))
    level += months.flicker * flicker(rng, RUNS)
    errors = months.error * np.exp(0.3 * rng.standard_normal(RUNS))
    level += errors * rng.standard_normal(RUNS) + rng.normal(0.0, 10.0)
    level[7] += months.bad_run
    if months.season:
        year = 2.0 * np.pi * np.arange(RUNS) / 52.0
        level += months.season * np.sin(year + rng.uniform(0.0, 2.0 * np.pi))
    size = months.size * rng.choice([-1.0, 1.0])
    after = np.maximum(np.arange(RUNS) - (months.onset - 1.0), 0.0)
    level += size * (after if months.shape == "ramp" else np.minimum(after, 1.0))
    return level, errors, size


def measured(name: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case."""
    months, false, again, onset, others = CASES[name], 0, 0, [], []
    sizes: list[Told | None] = []
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        drawn = [recorded(months, rng) for _ in range(months.figures)]
        levels = {str(number): level for number, (level, _, _) in enumerate(drawn)}
        errors = {str(number): error for number, (_, error, _) in enumerate(drawn)}
        chart, size = change_chart(levels, np.arange(float(RUNS)), LIMIT, errors=errors), drawn[0][2]
        if not months.shape:
            false += bool(chart.changes)
            continue
        false += any(change.raised_at < months.onset for change in chart.changes)
        real = [change for change in chart.changes if change.raised_at >= months.onset]
        again += len(real) > 1
        others += [(one.shape != months.shape, 1.0 - one.probability) for one in real[:1]]
        if real and real[0].shape == months.shape:
            sizes.append(of_interval(real[0].size, size, real[0].size_ci90))
            low, high = real[0].onset_ci90
            onset.append(low <= months.onset <= high)
    before = RUNS if not months.shape else months.onset
    rows = [share(name, f"a false alarm in {before} runs", false, repeats, before / LIMIT)]
    if onset:
        rows.append(coverage(name, "size of the change", sizes))
        rows.append(
            share(name, "run of onset not among those of 90 %", len(onset) - sum(onset), len(onset), 0.1)
        )
        wrong, stated = np.array(others, dtype=np.float64).T
        rows.append(share(name, "of another shape", int(wrong.sum()), len(others), float(stated.mean())))
        since = RUNS - months.onset
        rows.append(share(name, f"a further alarm in {since} runs", again, len(others), since / LIMIT))
    return rows
