"""Accuracy on runs that no model has seen: fogml beside what a user would pick instead."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from experiments.benchmarks.accuracy_cases import (
    Case,
    cold_start,
    quiet_twin_runs,
    thermal_cycle,
    twin_runs,
)
from experiments.benchmarks.peer_model import Budget, PeerModel
from experiments.benchmarks.peers import PEERS
from experiments.benchmarks.reasons import winners
from experiments.benchmarks.study import Study
from fogml.arrays import FloatArray
from fogml.models.base import DriftModel
from fogml.models.names import make_model
from fogml.processes import available_cores, in_processes
from fogml.signals.averages import block_averages
from fogml.validation.floors import floor_of_run
from fogml.validation.run_errors import run_errors, training_means

Row = dict[str, Any]
NOTHING = "no model"
OURS = ("fogml rbf", "fogml auto")
AGAIN = (NOTHING, *OURS)
FULL = Budget(settings=4, folds=3, most_rows=3000)
QUICK = Budget(settings=2, folds=2, most_rows=120)
_LABELS = ("axis", "train", "test", "programme", "trained")
QUICK_PEERS = ("cubic", "kernel-ridge")


def models(budget: Budget, quick: bool = False) -> dict[str, Callable[[], DriftModel]]:
    """Label to a function that makes the unfitted model."""
    peers = [peer for peer in PEERS if not quick or peer.name in QUICK_PEERS]
    return {
        NOTHING: partial(make_model, "mean"),
        OURS[0]: partial(make_model, "rbf"),
        OURS[1]: partial(make_model, "auto"),
        **{peer.name: partial(PeerModel, peer, budget) for peer in peers},
    }


def judged(case: Case, made: Mapping[str, DriftModel]) -> list[Row]:
    """One entry for each fitted model: figures of averages on the test run, on the same rows [deg/h].

    Where Earth rate is not known, each model's error is less its own mean over the training runs.
    """
    run = case.test
    errors = {label: run_errors(model, run) for label, model in made.items()}
    used = np.logical_and.reduce([each.used for each in errors.values()])
    time = run.time[used]

    def averaged(values: FloatArray) -> FloatArray:
        return np.asarray(block_averages(time, values[used], window_s=case.averaging_s).values[0])

    known = all(each.earth_known for each in (run, *case.train))
    if case.noise is not None:
        noise = averaged(case.noise)
        # A unit's constant is new at every power-on, and no model of temperature can know it.
        floor = float(noise.std())
    else:
        floor = floor_of_run(run, used, run.error_deg_h, case.averaging_s).value
    rows = []
    for label, model in made.items():
        constant = 0.0
        if not known:
            constant = training_means([run_errors(model, each, any_unit=True) for each in case.train])[1]
        after = averaged(errors[label].after) - constant
        row: Row = {"group": case.group, **case.labels, "model": label, "averaging_s": case.averaging_s}
        row |= {
            "rms": float(np.sqrt(np.mean(after**2))),
            "bias_stability": float(after.std()),
            "floor": floor,
        }
        if case.noise is not None:
            row["error"] = float((after - noise).std())
        if isinstance(model, PeerModel):
            row |= {"setting": dict(model.setting_), "rows": model.rows_}
        rows.append(row)
    return rows


def measure(
    cases: Callable[[bool], Iterable[Case]], quick: bool, repeats: int, folder: Path
) -> dict[str, Any]:
    """All rows of some cases."""
    budget = QUICK if quick else FULL
    settings = {"settings": budget.settings, "folds": budget.folds, "most_rows": budget.most_rows}
    trainings: dict[int, list[Case]] = {}
    for case in cases(quick):
        trainings.setdefault(id(case.train), []).append(case)
    rows_of_training = partial(_rows_of_training, budget, quick)
    workers = 1 if quick else available_cores()
    found = in_processes(rows_of_training, list(trainings.values()), workers, ordered=True)
    return {"rows": [row for rows in found for row in rows], "budget": settings}


def _rows_of_training(budget: Budget, quick: bool, cases: Sequence[Case]) -> list[Row]:
    return rows_of(cases, models(budget, quick))


def rows_of(cases: Iterable[Case], made: Mapping[str, Callable[[], DriftModel]]) -> list[Row]:
    """Rows of models on some cases; models of one training are fitted once."""
    rows: list[Row] = []
    fitted: dict[str, DriftModel] = {}
    trained: tuple[Any, ...] = ()
    for case in cases:
        if trained is not case.train:
            fitted, trained = {label: make() for label, make in made.items()}, case.train
            for model in fitted.values():
                model.fit(list(case.train))
        found = judged(case, fitted)
        told = {row["model"]: float(f"{row['rms'] / row['floor']:.3g}") for row in found}
        print(" ".join(case.labels.values()), told, file=sys.stderr, flush=True)
        rows += found
    return rows


def case_of(row: Row) -> tuple[Any, ...]:
    """What is the same of the rows of one case."""
    return row["group"], *(row.get(label) for label in _LABELS)


def with_ours_again(found: Mapping[str, Any], rows: Sequence[Row], date: str) -> dict[str, Any]:
    """A study's figures with rows of fogml's own models, and every case's floor, in place of those there.

    Raises
    ------
    ValueError
        If the rows are not of the same cases, judged on the same samples: what no model leaves is the same.
    """
    new = {(case_of(row), row["model"]): row for row in rows}
    old = {(case_of(row), row["model"]): row for row in found["rows"] if row["model"] in AGAIN}
    if set(new) != set(old) or any(
        not np.isclose(new[k]["rms"], old[k]["rms"]) for k in old if k[1] == NOTHING
    ):
        raise ValueError("the cases changed: measure the whole study again")
    floors = {case: row["floor"] for (case, _), row in new.items()}
    kept = [new.get((case_of(row), row["model"]), row) for row in found["rows"]]
    rows = [row | {"floor": floors[case_of(row)]} for row in kept]
    return {**found, "rows": rows, "ours_again": date}


def over_floor(row: Row) -> float:
    """The figure that is ranked: rms over the floor, of twins bias stability over that of the noise."""
    return float((row["bias_stability"] if "error" in row else row["rms"]) / row["floor"])


def table(rows: Sequence[Row], by: str, figure: Callable[[Row], float] = over_floor) -> str:
    """Geometric means of a figure for each model, a column for each value of a label."""
    values = list(dict.fromkeys(row[by] for row in rows))
    labels = list(dict.fromkeys(row["model"] for row in rows))
    cases = [case_of(row) for row in rows]
    least = {
        case: min(figure(row) for row, its in zip(rows, cases) if its == case)
        for case in dict.fromkeys(cases)
    }
    lines = [
        f"| model | {' | '.join(values)} | all | worst | best in |",
        "|---|" + "---:|" * (len(values) + 3),
    ]
    means = {}
    for label in labels:
        own = [(row, case) for row, case in zip(rows, cases) if row["model"] == label]
        found = [figure(row) for row, _ in own]
        columns = [mean([figure(row) for row, _ in own if row[by] == value]) for value in values]
        best = sum(figure(row) == least[case] for row, case in own)
        means[label] = (*columns, mean(found)), max(found), best
    best_in_column = np.argmin([columns for columns, _, _ in means.values()], axis=0)
    lowest = np.min([columns for columns, _, _ in means.values()], axis=0)
    for label, (columns, worst, best) in means.items():
        cells = [f"**{v:.3g}**" if v == low else f"{v:.3g}" for v, low in zip(columns, lowest)]
        lines.append(f"| {label} | {' | '.join(cells)} | {worst:.3g} | {best} of {len(least)} |")
    told = winners([list(means)[i] for i in best_in_column])
    lines += ["", told] if told else []
    return "\n".join(lines)


def mean(values: Sequence[float]) -> float:
    """Geometric mean."""
    return float(np.exp(np.mean(np.log(values))))


def _budget_words(found: Mapping[str, Any]) -> str:
    b = found["budget"]
    again = found.get("ours_again")
    later = (
        f" fogml's own rows and all floors were measured again on {again}, the peers' are as they were."
        if again
        else ""
    )
    return (
        f"Each peer tries {b['settings']} settings on the same {b['folds']} folds of time blocks of the "
        f"training rows, averaged to at most {b['most_rows']:,} rows or fewer as its line in the list of "
        "peers says; inputs T, dT and T·dT limited to the trained box. `fogml rbf` has the same inputs, "
        f"`fogml auto` chooses its own.{later}"
    )


def real_page(found: Mapping[str, Any]) -> str:
    """Tables of the real recordings."""
    words = "rms of averages over the noise floor of the test run; geometric means."
    parts = [_budget_words(found), "", words]
    rows = found["rows"]
    for group in dict.fromkeys(row["group"] for row in rows):
        own = [row for row in rows if row["group"] == group]
        floors = sorted({row["floor"] for row in own})
        parts += [
            "",
            f"**Real, {group} of a MEMS unit** (no fibre-optic gyro), averages over "
            f"{own[0]['averaging_s']:.1f} s, floors {floors[0]:.2g} to {floors[-1]:.2g} deg/h; "
            + ("by axis:" if group == "thermal cycle" else "each third left out, by third:"),
            "",
            table(own, "axis" if group == "thermal cycle" else "test"),
        ]
    return "\n".join(parts)


def twin_page(found: Mapping[str, Any]) -> str:
    """Table of the twin runs."""
    words = (
        "**Synthetic** (tactical twin with its effects on, hysteresis and warm-up among them, 5 s samples). "
        "Bias stability of 100 s averages over that of the noise realised in the test run; geometric means "
        "over programmes. Ramps of the programmes of the source methods at their own rate, or at 0.5, 1 and "
        "2 times it, in training; at 0.7 and 1.5 times it in the test. The fifth programme, four positions "
        "at 25 °C, has no ramp and is left out."
    )
    rows = found["rows"]
    named = [{**row, "how": f"{row['trained']}, {row['test']}"} for row in rows]
    parts = [_budget_words(found), "", words, "", table(named, "how")]
    parts += ["", "By programme:", "", table(named, "programme")]
    parts += ["", "Standard deviation of the same averages from the noise-free truth [deg/h]:", ""]
    parts += [table(named, "how", lambda row: float(row["error"]))]
    return "\n".join(parts)


def quiet_page(found: Mapping[str, Any]) -> str:
    """Table of the twin runs without slow noise."""
    named = [{**row, "how": f"{row['trained']}, {row['test']}"} for row in found["rows"]]
    words = (
        "**Synthetic**, the same units, programmes and models with white noise alone: flicker, rate "
        "random walk "
        "and quantisation are off in training and test. What the errors lose against the section above "
        "is the "
        "training runs' slow noise, which any model takes for drift. Standard deviation of 100 s "
        "averages from "
        "the noise-free truth [deg/h]:"
    )
    return "\n".join([words, "", table(named, "how", lambda row: float(row["error"]))])


def _real(quick: bool) -> Iterable[Case]:
    yield from thermal_cycle(quick)
    yield from cold_start(quick)


CASES = {"accuracy-real": _real, "accuracy-twin": twin_runs, "accuracy-twin-quiet": quiet_twin_runs}
_TOLD = {
    "accuracy-real": ("accuracy on held-out real runs", real_page),
    "accuracy-twin": ("accuracy on held-out twin runs", twin_page),
    "accuracy-twin-quiet": ("accuracy on held-out twin runs, white noise only", quiet_page),
}
ACCURACY_STUDIES = tuple(
    Study(name, title, partial(measure, CASES[name]), page) for name, (title, page) in _TOLD.items()
)
