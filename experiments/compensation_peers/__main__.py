"""Small models, a process, boosting and `auto` on all real pairings and simulated strata.

``python -m experiments.compensation_peers`` writes ``results.json`` and ``results.md`` beside itself, with
what explains the variance of the outcome. With ``--data "cold start"`` that group alone is run again. The
thermal cycle's figures are those of ``python -m experiments.thermal_cycle``.
"""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from experiments.benchmarks import accuracy
from experiments.cold_start.__main__ import AVERAGING_S as COLD_AVERAGING_S
from experiments.cold_start.__main__ import PAIRINGS
from experiments.compensation_peers.variance import NAMES, intervals, shares
from experiments.results import write_results
from experiments.strata.units import AVERAGING_S, STRATA, case, recorded
from experiments.thermal_cycle.__main__ import BOOSTING, PROCESS
from experiments.thermal_cycle.__main__ import HERE as CYCLE
from experiments.thermal_cycle.small_models import SMALL, SmallModel
from fogml import __version__
from fogml.errors import InputError
from fogml.features.features import Features
from fogml.features.terms import composition_plan
from fogml.models.base import DriftModel
from fogml.models.compact import operations_of_compact, operations_of_features
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_run
from fogml.validation.compare import compare

HERE = Path(__file__).parent
BENCHMARKS = Path(accuracy.__file__).parent
Row = dict[str, Any]
MODELS: dict[str, Callable[[], DriftModel]] = {
    "mean": partial(make_model, "mean"),
    "cubic in T": partial(make_model, "polynomial", "T^1..3"),
    **{name: partial(SmallModel, name) for name in SMALL},
    "Gaussian process": partial(make_model, PROCESS, "T, dT"),
    "boosting": partial(make_model, BOOSTING, "T, dT"),
    "auto": partial(make_model, "auto"),
}
CYCLES, SEEDS = (1, 2, 3), (100, 101)
GROUPS = ("thermal cycle", "cold start", "strata")
_CALLED = {"GRU, 404 bytes": "GRU", "TCN, 340 bytes": "TCN", "KAN, 364 bytes": "KAN"}
"""Names of the thermal cycle's page."""


def thermal_cycle() -> Iterable[Row]:
    """The figures that stand beside that experiment, of the models here."""
    for row in json.loads((CYCLE / "results.json").read_text(encoding="utf-8")):
        model = _CALLED.get(row["model"], row["model"])
        if model in MODELS:
            place = {"set": f"cycle {row['axis']}", "protocol": f"{row['train']}-{row['test']}", "seed": 0}
            figures = {key: row[key] for key in ("rms", "coverage", "floor")}
            yield {"group": "thermal cycle", **place, "model": model, **figures}


def cold_start() -> Iterable[Row]:
    """Thirds of the cold start against each other."""
    for axis in "xyz":
        run = shipped_run(f"cold-start-{axis}")
        edges = np.linspace(0, len(run), 4).astype(int)
        thirds = [run[low:high] for low, high in pairwise(edges)]
        for train, test in PAIRINGS:
            place = {"set": f"start {axis}", "protocol": f"{train}-{test}", "seed": 0}
            yield from _judged(
                "cold start", place, [thirds[i] for i in train], thirds[test], COLD_AVERAGING_S
            )


def strata() -> Iterable[Row]:
    """Simulated units of each stratum, trained on one to three cycles."""
    for stratum in STRATA:
        for cycles in CYCLES:
            for seed in SEEDS:
                train, test = case(stratum, cycles, seed)
                place = {"set": stratum, "protocol": f"{cycles}", "seed": seed}
                yield from _judged("strata", place, [recorded(train)], recorded(test), AVERAGING_S)


def _judged(
    group: str, place: Mapping[str, Any], train: Sequence[Run], test: Run, averaging_s: float
) -> Iterable[Row]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a process at its bounds is its result
        compared = compare(MODELS, train, [test], averaging_s=averaging_s)
    if compared.failed:
        raise InputError(f"{place}: {compared.failed}")
    for model, judgement in compared.judgements.items():
        judged = judgement.test[0]
        coverage = float(np.mean(np.abs(judged.series.after) <= judged.series.upper))
        figures = {"rms": judged.after.rms, "coverage": coverage, "floor": judged.floor}
        yield {"group": group, **place, "model": model, **figures}
    print(group, place, flush=True)


def sizes() -> dict[str, dict[str, int | None]]:
    """Numbers as float32 and operations of a sample, of fits to one leg of the thermal cycle (up, y)."""
    run = shipped_run("thermal-cycle-2-y")
    found = {}
    for name, make in MODELS.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = make().fit(run)
        count = _operations(model, run.sample_s)
        found[name] = {"bytes": 4 * model.parameter_count(), "operations": count}
    return found


def _operations(model: DriftModel, sample_s: float) -> int:
    """From a sample to its drift, the features' included."""
    if isinstance(model, SmallModel):
        return model.operations() + _of_features(model.features_, sample_s)
    try:
        compact = model.compact()
    except InputError:
        # Boosting: a comparison at each level of a tree, and one sum.
        trees = [tree for stage in model.regressor_.regressor_[-1]._predictors for tree in stage]  # type: ignore[attr-defined]
        depths = sum(tree.get_max_depth() + 1 for tree in trees)
        return int(_of_features(model.features_, sample_s) + depths)
    return operations_of_compact(compact) + _of_features(model.features_, sample_s)


def _of_features(features: Features | None, sample_s: float) -> int:
    if features is None:
        return 0
    return operations_of_features(features.atoms, composition_plan(features.terms, features.atoms), sample_s)


def page(values: Mapping[str, Any]) -> str:
    """``results.md`` of what ``results.json`` holds."""
    return f"""# Models of others on all real pairings and simulated strata

Data: legs of the shipped thermal cycle against each other (27 pairings) and thirds of the shipped cold start
(27), both of **MEMS** units; **synthetic** tactical units of six strata (`experiments/strata`: one to three
cycles in training, {len(SEEDS)} units each, 36 cases), as far as they have a column. No fibre-optic gyro.
All models of a case are judged on the same rows. fogml {__version__};
`python -m experiments.compensation_peers`.

The cubics follow their autopilots' rules: fitted to the one run that warms up furthest, from its coldest
sample on, by 24 °C (PX4) or 10 °C (ArduPilot) at least, held beyond the range so seen, and else the mean
alone: so on every leg and third that cools. Networks of at most 500 bytes see T and its rate, at most 800
averages. Nothing was tuned on these cases. `auto` was developed with the thermal cycle in view.

Rms / no compensation, geometric means; *worse* than none beyond the noise floor; coverage of the stated 90 %
intervals by averages, where a model states any (a network's are those of its training residuals). Bytes are
numbers in float32, operations a sample with those of the features, of a fit to one leg (y, up), where told.

{_table(values)}

## What explains the outcome

Of the sum of squares of log(rms / no compensation); 95 % intervals by drawing data sets, which are the axes
of each recording, the strata or the programmes. No compensation itself is no model here. Recordings have one
seed.

{chr(10).join(_explained(words, *outcome) for words, outcome in _outcomes(values["rows"]))}

{_seeds(values)}
"""


def _explained(words: str, y: Any, places: list[tuple[str, str]]) -> str:
    parts, (low, high) = shares(y, places), intervals(y, places)
    lines = [
        f"| {name} | {100 * part:.0f} % | {100 * a:.0f} … {100 * b:.0f} % |"
        for name, part, a, b in zip(NAMES, parts, low, high)
        if part > 1e-9
    ]
    told = (
        f"{words}: {y.shape[0]} cases, {len({place[0] for place in places})} data sets, {y.shape[1]} models."
    )
    return "\n".join([told, "", "| source | share | interval |", "|---|---:|---:|", *lines, ""])


def _outcomes(rows: Sequence[Row]) -> list[tuple[str, tuple[Any, list[tuple[str, str]]]]]:
    """The peers of ``experiments/benchmarks`` on recordings and the twin, and the cases here."""
    studies = json.loads((BENCHMARKS / "results.json").read_text(encoding="utf-8"))["studies"]
    cases: dict[tuple[str, str], dict[str, float]] = {}
    for study in studies:
        if study["name"] in ("accuracy-real", "accuracy-twin"):
            for row in study["rows"]:
                of_set = f"{row['group']} {row.get('axis') or row['programme']}"
                protocol = f"{of_set} {row.get('train') or row.get('trained')} {row['test']}"
                cases.setdefault((of_set, protocol), {})[row["model"]] = float(row["rms"])
    names = [name for name in next(iter(cases.values())) if name != "no model"]
    y = [[np.log(own[name] / own["no model"]) for name in names] for own in cases.values()]
    words = "Peers of `experiments/benchmarks` on legs, thirds and twin runs"
    return [(words, (np.array(y), list(cases))), ("The cases above", _outcome(rows))]


def _outcome(rows: Sequence[Row]) -> tuple[Any, list[tuple[str, str]]]:
    """Log ratios, shape (cases, models), and data set and protocol of each case."""
    cases = _cases(rows)
    names = [name for name in MODELS if name != "mean"]
    y = [[np.log(own[name]["rms"] / own["mean"]["rms"]) for name in names] for own in cases.values()]
    return np.array(y), [(place[1], f"{place[1]} {place[2]}") for place in cases]


def _cases(rows: Sequence[Row]) -> dict[tuple[Any, ...], dict[str, Row]]:
    cases: dict[tuple[Any, ...], dict[str, Row]] = {}
    for row in rows:
        key = (row["group"], row["set"], row["protocol"], row["seed"])
        cases.setdefault(key, {})[row["model"]] = row
    return {key: own for key, own in cases.items() if set(own) == set(MODELS)}


def _table(values: Mapping[str, Any]) -> str:
    cases = _cases(values["rows"])
    groups = [group for group in GROUPS if any(key[0] == group for key in cases)]
    heads = [f"{group} ({sum(key[0] == group for key in cases)})" for group in groups]
    lines = [
        f"| model | bytes | operations | {' | '.join(heads)} | worse | at most | coverage |",
        "|---|" + "---:|" * (len(groups) + 5),
    ]
    for name in MODELS:
        cells = []
        for group in groups:
            own = [c[name]["rms"] / c["mean"]["rms"] for key, c in cases.items() if key[0] == group]
            cells.append(f"{np.exp(np.mean(np.log(own))):.2f}")
        worse = sum(c[name]["rms"] > c["mean"]["rms"] + c[name]["floor"] for c in cases.values())
        most = max(c[name]["rms"] / c["mean"]["rms"] for c in cases.values())
        covered = [c[name]["coverage"] for c in cases.values()]
        told = f"{np.mean(covered):.2f}" if any(covered) else "–"
        size = values["sizes"].get(name)
        told_size = f"{size['bytes']:,} | {size['operations']:,}" if size else "– | –"
        head = f"| {name} | {told_size} | {' | '.join(cells)} |"
        lines.append(f"{head} {worse} of {len(cases)} | × {most:.1f} | {told} |")
    return "\n".join(lines)


def weight_seeds() -> dict[str, float]:
    """Standard deviation of the log ratio over three seeds of the weights, legs of the cycle, axis y."""
    runs = {leg: shipped_run(f"thermal-cycle-{leg}-y") for leg in "123"}
    found = {}
    for name in ("TCN", "KAN"):
        spreads = []
        for train, test in (("1", "2"), ("2", "1"), ("2", "3"), ("3", "1")):
            makers = {str(seed): partial(SmallModel, name, seed) for seed in range(3)}
            compared = compare(makers, [runs[train]], [runs[test]], averaging_s=20 * runs[test].sample_s)
            logs = [np.log(judged.test[0].after.rms) for judged in compared.judgements.values()]
            spreads.append(np.var(logs, ddof=1))
        found[name] = float(np.sqrt(np.mean(spreads)))
    return found


def _seeds(values: Mapping[str, Any]) -> str:
    if not values["weight_seeds"]:
        return ""
    told = ", ".join(f"{name} {100 * (np.exp(sd) - 1):.0f} %" for name, sd in values["weight_seeds"].items())
    return (
        f"Another seed of a network's weights alone changes its rms by (a standard deviation over three "
        f"seeds on four pairings of axis y): {told}."
    )


def main() -> None:
    """Compute and write the results."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--data", action="append", choices=GROUPS, help="this group alone; may be repeated")
    parser.add_argument("--quick", action="store_true", help="without fits for sizes and seeds: as they were")
    given = parser.parse_args()
    chosen = given.data or list(GROUPS)
    path = HERE / "results.json"
    before = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    rows = [row for row in before.get("rows", []) if row["group"] not in chosen]
    makers = {"thermal cycle": thermal_cycle, "cold start": cold_start, "strata": strata}
    for group in chosen:
        rows += makers[group]()
    fits = {"sizes": sizes, "weight_seeds": weight_seeds}
    again = {name: before.get(name, {}) if given.quick else made() for name, made in fits.items()}
    values = {"rows": rows, **again}
    write_results(HERE, values, page(values))


if __name__ == "__main__":
    main()
