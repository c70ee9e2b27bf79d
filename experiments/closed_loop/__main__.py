"""A cause found on two runs, compensated on the third, on fresh synthetic units by kind of cause.

Run ``python -m experiments.closed_loop``; it writes ``results.json`` and ``results.md`` beside itself, and
goes on from a ``results.json`` that holds some of the units. Units are those of the check on withheld effects
(``fogml blind``): another plant, other forms and other noise than the diagnosis has. Each is diagnosed as
``fogml diagnose`` does, then modelled as ``fogml train --from-diagnosis`` does.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from experiments.results import write_results
from fogml import __version__
from fogml.blind.make import draw_case, recorded_run
from fogml.blind.plan import REALITIES, Plan
from fogml.blind.scoring.statistics import wilson
from fogml.cli.from_diagnosis import cause_model
from fogml.gap.diagnosis import diagnose
from fogml.models.base import DriftModel
from fogml.models.causes import CauseModel
from fogml.models.names import make_model
from fogml.runs.shipped import shipped_run
from fogml.twin.twin_file import load_twin
from fogml.validation.judge import judge

HERE = Path(__file__).parent
SEED, SAMPLE_S = 4501, 10.0
D_PRIME = (20.0, 60.0)
"""Whitened length of the cause over the fit runs: plain to see, and below what would drown all else."""
KINDS = (
    "thermal_hysteresis",
    "polarization_nonreciprocity",
    "warmup_bias",
    "stress_relaxation",
    "hidden_thermal_node",
    "glass_transition",
    "temperature_rate_product",
    "shupe_pure",
)
MODELS = ("before", "constants", "auto", "diagnosis", "true cause", "floor")


def unit(number: int) -> dict[str, Any]:
    """Figures of one unit."""
    kind, of = KINDS[number % len(KINDS)], REALITIES[number // len(KINDS) % len(REALITIES)]
    plan = Plan(number + 1, "one", kind, 0, (), 2, True, (D_PRIME,), False, of)
    drawn, acting = draw_case(plan, SEED, SAMPLE_S)
    fit = [recorded_run(drawn, run, acting, plan) for run in drawn.fit]
    held = [recorded_run(drawn, run, acting, plan) for run in drawn.held_out]
    assert drawn.static is not None
    static = recorded_run(drawn, drawn.static, (), plan)
    found = diagnose(load_twin("nominal"), fit, held, noise=static, plan=False)
    told = found.compensation
    assert told is not None
    by_id = {c.effect: c for c in told.causes}
    models: dict[str, DriftModel] = {
        "constants": CauseModel(", ".join(told.constants)),
        "auto": make_model("auto"),
        "diagnosis": cause_model(told),
        "true cause": cause_model(told, [kind] if by_id[kind].features else []),
    }
    fitted = {name: model.fit(fit) for name, model in models.items()}
    judged = {
        name: judge(
            model,
            fit,
            held,
            any_unit=True,
            noise=static,
            beside=[m for m in fitted.values() if m is not model],
        ).test[0]
        for name, model in fitted.items()
    }
    first = judged["diagnosis"]
    return {
        "number": number,
        "kind": kind,
        "reality": of,
        "verdict": found.verdict,
        "named": [f.effect for f in found.named],
        "found": any(kind in f.members for f in found.named),
        "before": first.before.rms,
        **{name: run.after.rms for name, run in judged.items()},
        "floor": first.floor,
        "outside_training": first.outside_training,
    }


def leg(axis: str) -> dict[str, Any]:
    """Figures of one axis of the real thermal cycle: two legs to fit on, the third to judge on."""
    fit = [shipped_run(f"thermal-cycle-{n}-{axis}") for n in (1, 2)]
    held = [shipped_run(f"thermal-cycle-3-{axis}")]
    found = diagnose(load_twin("nominal"), fit, held, plan=False)
    told = found.compensation
    assert told is not None
    models = {"constants": CauseModel(", ".join(told.constants)), "auto": make_model("auto")}
    models["diagnosis"] = cause_model(told)
    fitted = {name: model.fit(fit) for name, model in models.items()}
    judged = {
        name: judge(model, fit, held, beside=[m for m in fitted.values() if m is not model]).test[0]
        for name, model in fitted.items()
    }
    first = judged["diagnosis"]
    figures = {name: run.after.rms for name, run in judged.items()}
    return {
        "axis": axis,
        "verdict": found.verdict,
        "named": [f.effect for f in found.named],
        "before": first.before.rms,
        **figures,
        "floor": first.floor,
        "averaging_s": first.averaging_s,
        "outside_training": first.outside_training,
    }


def real_table(legs: list[dict[str, Any]]) -> list[str]:
    """Lines of the page on the real recording."""
    if not legs:
        return []
    lines = [
        "## A real recording",
        "",
        "The shipped thermal cycle of a MEMS unit, no fibre-optic gyro: legs 1 and 2 to fit on, leg 3 to "
        f"judge on, each axis by itself, rms of {legs[0]['averaging_s']:.0f} s averages [deg/h]. "
        "Its floor is the run's own.",
        "",
        "| axis | verdict | named | before | constants | auto | diagnosis | floor | outside training |",
        "|---|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for r in legs:
        figures = " | ".join(f"{r[key]:.3g}" for key in ("before", "constants", "auto", "diagnosis", "floor"))
        named = ", ".join(r["named"]) or "nothing"
        share = f"{100.0 * r['outside_training']:.0f} %"
        lines.append(f"| {r['axis']} | {r['verdict'].replace('_', ' ')} | {named} | {figures} | {share} |")
    return [*lines, ""]


def page(rows: list[dict[str, Any]], minutes: float, legs: list[dict[str, Any]]) -> str:
    """The result page."""
    lines = [
        "# A cause found on two runs, compensated on the third",
        "",
        f"fogml {__version__}, `python -m experiments.closed_loop`, {minutes:.0f} core-minutes. Synthetic: "
        f"{len(rows)} fresh units (seed {SEED}) of the three realities of `fogml blind` in turn, one cause "
        f"each of whitened length {D_PRIME[0]:g} to {D_PRIME[1]:g}, two runs to fit on at {SAMPLE_S:g} s, "
        "a static run, and a third run of another programme to judge on. Rms of 100 s averages on that run "
        "[deg/h], medians over units. `constants` is the twin's alone, `diagnosis` with the causes that were "
        "named, `true cause` with the one that acts, as if it had been named.",
        "",
        f"| cause | units | found | {' | '.join(MODELS)} | diagnosis below auto |",
        f"|---|---:|---:|{'---:|' * len(MODELS)}---:|",
    ]
    groups = [(kind.replace("_", " "), [r for r in rows if r["kind"] == kind]) for kind in KINDS]
    groups += [
        ("all where the cause is found", [r for r in rows if r["found"]]),
        ("the same, under a tenth outside training", [r for r in rows if r["found"] and _within(r)]),
        ("all where it is not", [r for r in rows if not r["found"]]),
        ("all", rows),
    ]
    for name, held in groups:
        if held:
            lines.append(_row(name, held))
    below = sum(r["diagnosis"] < r["auto"] for r in rows)
    share = wilson(below, len(rows))
    found = [r for r in rows if r["found"]]
    over, auto = (_over_floor(found, name) for name in ("diagnosis", "auto"))
    within, within_auto = (
        _over_floor([r for r in found if _within(r)], name) for name in ("diagnosis", "auto")
    )
    outside = 100.0 * float(np.mean([r["outside_training"] for r in rows]))
    lines += [
        "",
        f"Below `auto` on {below} of {len(rows)} units, {100 * (share.value or 0):.0f} % (95 % interval "
        f"{100 * (share.low or 0):.0f} to {100 * (share.high or 0):.0f} %). Where the cause is found, the "
        f"median is {over:.2f} times the floor from the diagnosis, {auto:.2f} times by `auto`; of those "
        f"whose third run stays within training but for a tenth, {within:.2f} and {within_auto:.2f} times.",
        "",
        "A model is limited to the temperatures that it was trained on: of the third run's samples "
        f"{outside:.0f} % lie outside on average, where all of these models stay at the edge.",
        "",
    ]
    return "\n".join([*lines, *real_table(legs)])


def _within(row: dict[str, Any]) -> bool:
    return bool(row["outside_training"] < 0.1)


def _over_floor(rows: list[dict[str, Any]], name: str) -> float:
    """Median of what a model leaves over the noise floor."""
    return float(np.median([r[name] / r["floor"] for r in rows])) if rows else float("nan")


def _row(name: str, held: list[dict[str, Any]]) -> str:
    medians = [f"{np.median([r[key] for r in held]):.3g}" for key in MODELS]
    found, below = sum(r["found"] for r in held), sum(r["diagnosis"] < r["auto"] for r in held)
    return f"| {name} | {len(held)} | {found} | {' | '.join(medians)} | {below} |"


def main() -> None:
    """Do the units that are not there yet, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=100, help="Units in all.")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="Core-minutes to end after.")
    given = parser.parse_args()
    kept = HERE / "results.json"
    held = {"minutes": 0.0, "units": [], "legs": []}
    held |= json.loads(kept.read_text(encoding="utf-8")) if kept.is_file() else {}
    rows, spent, begun = held["units"], held["minutes"], time.process_time()

    def write() -> None:
        values = {"minutes": spent, "units": rows, "legs": held["legs"]}
        write_results(HERE, values, page(rows, spent, held["legs"]))

    for number in range(len(rows), given.units):
        if spent - held["minutes"] > given.minutes:
            break
        rows.append(unit(number))
        spent, begun = spent + (time.process_time() - begun) / 60.0, time.process_time()
        write()
    held["legs"] = held["legs"] or [leg(axis) for axis in "xyz"]
    write()


if __name__ == "__main__":
    main()
