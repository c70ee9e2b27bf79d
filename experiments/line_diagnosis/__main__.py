"""A line of units diagnosed as ``fogml fleet`` does, against what acts in them.

Run ``python -m experiments.line_diagnosis FOLDER``; it writes the units' runs and their manifest into
FOLDER, the fleet's results into ``FOLDER/line``, and ``results.json`` and ``results.md`` beside itself. With
``--dask`` the units are done on a Dask cluster of two processes (extra ``cluster``), and some of them in this
process as well, to be compared. Units are of the first reality of ``fogml blind``: another plant, other forms
and other noise than the diagnosis has. What is done already in FOLDER is not done again.
"""

from __future__ import annotations

import argparse
import csv
import json
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from experiments.results import write_results
from fogml import __version__
from fogml.blind.first.effects.coil import HysteresisPreisach, WarmupStretched
from fogml.blind.first.effects.electrical import PolarisationChirped
from fogml.blind.first.reality import REALITY
from fogml.blind.frame.form import Form
from fogml.blind.frame.strength import Acting
from fogml.blind.make import recorded_run
from fogml.blind.plan import Plan
from fogml.cli.fleet_job import fleet_and_write
from fogml.cli.run_commands import FleetSettings
from fogml.cli.terminal import Terminal
from fogml.fleet.tasks import OUTCOME
from fogml.gap.result import NAMED
from fogml.runs.writing import write_run

HERE = Path(__file__).parent
SEED, SAMPLE_S, UNITS, SAME = 4511, 60.0, 200, 20
LOTS = ("A", "B", "C", "D")
HYSTERESIS, POLARIZATION, WARMUP = "thermal_hysteresis", "polarization_nonreciprocity", "warmup_bias"
FORMS: dict[str, Form] = {
    HYSTERESIS: HysteresisPreisach(),
    POLARIZATION: PolarisationChirped(),
    WARMUP: WarmupStretched(),
}
SHARE = {HYSTERESIS: 0.8, POLARIZATION: 0.9, WARMUP: 0.015}
"""How many units have it; of the second in lot C alone, where its coupler is another."""
SIZE = {HYSTERESIS: (0.4, 0.06), POLARIZATION: (0.3, 0.05), WARMUP: (0.6, 0.1)}
"""Mean and deviation between units [deg/h]."""
ODD, TIMES = 4, 3.0
"""Units whose hysteresis is so many times the line's."""


def truth() -> list[dict[str, Any]]:
    """What acts in each unit: lot, and amplitude [deg/h] by effect."""
    rng = np.random.default_rng(SEED)
    odd = set(rng.choice(UNITS, ODD, replace=False).tolist())
    told = []
    for number in range(UNITS):
        lot = LOTS[number % len(LOTS)]
        shares = SHARE | {POLARIZATION: SHARE[POLARIZATION] * (lot == "C")}
        has = {effect: bool(rng.random() < share) for effect, share in shares.items()}
        size = {effect: float(rng.normal(*SIZE[effect])) for effect in FORMS}
        if number in odd:
            has[HYSTERESIS], size[HYSTERESIS] = True, TIMES * size[HYSTERESIS]
        acting = {effect: size[effect] for effect in FORMS if has[effect]}
        told.append({"unit": f"FOG-{number + 1:04d}", "lot": lot, "odd": number in odd, "acting": acting})
    return told


def write_line(folder: Path, told: Sequence[Mapping[str, Any]]) -> None:
    """Write the units' runs, as far as they are not there."""
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    for number, one in enumerate(told, start=1):
        if not all((folder / name).is_file() for name in _runs(one)):
            _write_unit(folder, number, one)


def manifest(path: Path, told: Sequence[Mapping[str, Any]]) -> str:
    """Write the manifest of units; its path."""
    rows = [[one["unit"], "diagnose", *_runs(one), one["lot"]] for one in told]
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([["unit", "job", "train", "test", "covariate:coil_lot"], *rows])
    return str(path)


def _runs(one: Mapping[str, Any]) -> list[str]:
    return [f"runs/{one['unit']}-{name}.csv" for name in ("fit-1", "held-out-1")]


def _write_unit(folder: Path, number: int, one: Mapping[str, Any]) -> None:
    rng = np.random.default_rng([SEED, number])
    unit = REALITY.draw_unit(rng, [type(form) for form in FORMS.values()], 1, False, SAMPLE_S)
    # One design: shapes differ little from unit to unit.
    shapes = {
        HYSTERESIS: {"half_width": 8.0 * np.exp(0.1 * rng.normal()), "spread": 0.35},
        POLARIZATION: {
            "period": 9.0 * np.exp(0.1 * rng.normal()),
            "phase": rng.uniform(0.0, 360.0),
            "drift": 0.0,
        },
        WARMUP: {"time_constant": 900.0, "exponent": 0.75},
    }
    acting = tuple(Acting(FORMS[effect], shapes[effect], size) for effect, size in one["acting"].items())
    plan = Plan(number, "one", None, 0, (), 1, False)
    for run in unit.runs:
        recorded = recorded_run(unit, run, acting, plan)
        recorded = replace(recorded, facts=recorded.facts.model_copy(update={"unit": one["unit"]}))
        write_run(recorded, folder / "runs" / f"{one['unit']}-{run.name}")


@contextmanager
def cluster(wanted: bool) -> Iterator[str | None]:
    """Address of a Dask cluster of two processes on this machine; None where none is wanted."""
    if not wanted:
        yield None
        return
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as held:
        yield held.scheduler_address


def differing(folder: Path, units: Sequence[str]) -> list[str]:
    """Units whose outcomes on the cluster and in this process are not the same to the last digit."""

    def held(where: str, unit: str) -> Any:
        return json.loads((folder / where / unit / OUTCOME).read_text(encoding="utf-8"))["found"]

    return [unit for unit in units if held("line", unit) != held("some", unit)]


def named_in(folder: Path, unit: str) -> set[str]:
    """Effects that a unit's diagnosis names."""
    found = json.loads((folder / "line" / unit / OUTCOME).read_text(encoding="utf-8"))["found"]
    return {one["effect"] for one in found["diagnosis"]["causes"] if one["probability"] >= NAMED}


def judged(folder: Path, told: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What the fleet's diagnosis tells, beside what acts."""
    fleet = json.loads((folder / "line" / "fleet.json").read_text(encoding="utf-8"))
    line = fleet["diagnosis"]
    named = {one["unit"]: named_in(folder, one["unit"]) for one in told}
    causes = []
    for cause in line["causes"]:
        effect = cause["effect"]
        has = [one for one in told if effect in one["acting"]]
        sizes = [one["acting"][effect] for one in has if not one["odd"]]
        right = sum(effect in named[one["unit"]] for one in has)
        causes.append(
            {
                "true_units": len(has),
                "true_mean": float(np.mean(sizes)) if sizes else None,
                "true_between": float(np.std(sizes, ddof=1)) if len(sizes) > 1 else None,
                "right": right,
                **{key: value for key, value in cause.items() if key not in ("members", "place")},
            }
        )
    odd = {one["unit"] for one in told if one["odd"]}
    apart = {item["unit"] for item in line["apart"] if item["kind"] == "size"}
    return {
        "units": len(told),
        "verdicts": dict(Counter(unit["verdict"] for unit in fleet["units"])),
        "unknown": line["unknown"],
        "gap_rms": line["gap_rms"],
        "causes": causes,
        "odd": sorted(odd),
        "apart_by_size": sorted(apart),
        "apart": line["apart"],
    }


def page(found: Mapping[str, Any]) -> str:
    """The result page."""
    verdicts = ", ".join(f"{key.replace('_', ' ')} {count}" for key, count in found["verdicts"].items())
    unknown = found["unknown"]["prevalence_ci90"]
    lines = [
        "# A line of units, diagnosed together",
        "",
        f"fogml {__version__}, `python -m experiments.line_diagnosis FOLDER --dask`. Synthetic: "
        f"{found['units']} units of one line (seed {SEED}) in the first reality of `fogml blind`, one run to "
        f"fit on and one held out, of four to ten hours at {SAMPLE_S:g} s. Four lots in turn. "
        f"{SHARE[HYSTERESIS]:.0%} have thermal hysteresis, {len(found['odd'])} of them {TIMES:g} times the "
        f"line's; {SHARE[POLARIZATION]:.0%} of lot C have polarisation nonreciprocity; "
        f"{SHARE[WARMUP]:.1%} a warm-up.",
        "",
        f"Verdicts: {verdicts}. Something unknown in {_percent(unknown)} of the units (90 %); nothing "
        f"unknown acts. Gap of the line {found['gap_rms']:.3g} deg/h rms.",
        "",
        "| cause | units that have it | named in | rightly | share of the line, 90 % | true | size [deg/h] | "
        "between units | true mean | true between units | of the gap, 90 % |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for cause in (one for one in found["causes"] if one["units_named"]):
        size = (
            "–" if cause["amplitude"] is None else f"{cause['amplitude']:.2g} ± {cause['amplitude_se']:.2g}"
        )
        cells = [
            cause["effect"],
            cause["true_units"],
            cause["units_named"],
            cause["right"],
            _percent(cause["prevalence_ci90"]),
            f"{cause['true_units'] / found['units']:.0%}",
            size,
            _figure(cause["between_units"]),
            _figure(cause["true_mean"]),
            _figure(cause["true_between"]),
            _percent(cause["energy_share_ci90"]),
        ]
        lines.append(f"| {' | '.join(str(cell) for cell in cells)} |")
    lots = [
        f"{cause['effect']} goes with {known['name']} (probability {known['probability']:.3f}): "
        + ", ".join(f"{value} {share:.0%}" for value, share in known["prevalence"].items())
        for cause in found["causes"]
        for known in cause["depends_on"]
    ]
    right = set(found["apart_by_size"]) & set(found["odd"])
    lines += [
        "",
        *(f"- {told}." for told in lots),
        f"- Told apart by size: {', '.join(found['apart_by_size']) or 'none'}; odd are "
        f"{', '.join(found['odd'])}: {len(right)} of {len(found['odd'])} found, "
        f"{len(found['apart_by_size']) - len(right)} told falsely.",
        f"- {_same(found)}",
        f"- Processor time: {found['seconds_a_unit']:.1f} s a unit without the search for a next run "
        f"(`--no-next-run`).",
        "",
    ]
    return "\n".join(lines)


def _percent(ends: Sequence[float]) -> str:
    return f"{100 * ends[0]:.0f} … {100 * ends[1]:.0f} %"


def _figure(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}"


def _same(found: Mapping[str, Any]) -> str:
    told = found["dask"]
    if told is None:
        return "Done in one process; not compared with a Dask cluster."
    others = ", ".join(told["differing"])
    what = f"not the same: {others}" if others else "every outcome is the same to the last digit"
    of = f"of {told['compared']} units done in one process too"
    return f"Done on a Dask cluster of two processes; {of}, {what}."


def main() -> None:
    """Write the line, diagnose it, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path, help="for the units' runs and the fleet's results")
    parser.add_argument("--units", type=int, default=UNITS, help=f"the first of the line ({UNITS})")
    parser.add_argument("--same", type=int, default=SAME, help=f"of them in this process as well ({SAME})")
    parser.add_argument("--dask", action="store_true", help="on a Dask cluster of two processes")
    given = parser.parse_args()
    folder: Path = given.folder
    told = truth()[: given.units]
    write_line(folder, told)
    settings = {"seed": SEED, "next_run": False}
    terminal = Terminal()
    every = settings | {"manifest": manifest(folder / "line.csv", told), "out": str(folder / "line")}
    with cluster(given.dask) as address:
        fleet_and_write(FleetSettings.model_validate(every | {"cluster": address}), terminal)
    found = judged(folder, told)
    some, begun = told[: given.same], time.process_time()
    few = settings | {"manifest": manifest(folder / "some.csv", some), "out": str(folder / "some")}
    fleet_and_write(FleetSettings.model_validate(few), terminal)
    found["seconds_a_unit"] = (time.process_time() - begun) / len(some)
    compared = {"compared": len(some), "differing": differing(folder, [one["unit"] for one in some])}
    found["dask"] = compared if given.dask else None
    write_results(HERE, found, page(found))


if __name__ == "__main__":
    main()
