"""Diagnosis: time of one and its growth, and other ways to name.

Figures of many blind cases are those of ``python -m experiments.gap_blind``.
"""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from experiments.benchmarks.limits import exponent
from experiments.benchmarks.needs import needs
from experiments.benchmarks.study import Study
from fogml.runs.run import Run

STEPS = (
    "soak at 25 degC for 1 h",
    "ramp to -40 degC at 1 degC/min",
    "soak at -40 degC for 2 h",
    "ramp to 60 degC at 1 degC/min",
    "soak at 60 degC for 2 h",
    "ramp to 25 degC at 1 degC/min",
    "soak at 25 degC for 100 min",
)
"""Ten hours."""
HOURS = 10.0
TIMES = (10_000, 100_000, 1_000_000)
QUICK_TIMES = (1_200, 2_400)
CASES, CASE_SEED = 8, 1
PEERS = {
    "pysindy": (("pysindy",), "experiments.benchmarks.diagnosis_peers:pysindy_discrepancy"),
    "sbi": (("sbi",), "experiments.benchmarks.diagnosis_peers:sbi_comparison"),
}
OWN = ("diagnosis", "bic", "stlsq")


def ten_hour_runs(sample_s: float) -> tuple[list[Run], Run]:
    """Two runs to fit and one held out of a unit with hysteresis, 10 h each."""
    from fogml.twin.simulate import simulate
    from fogml.twin.twin_file import load_twin

    twin = load_twin("nominal").with_effect("thermal_hysteresis", 0.05)
    made = [simulate(list(STEPS), twin, sample_s=sample_s, seed=seed).run for seed in range(3)]
    a, b, c = (Run(f"run-{i + 1}.csv", run.columns, run.facts) for i, run in enumerate(made))
    return [a, b], c


def one_diagnosis(sample_s: float) -> float:
    """Seconds of one diagnosis, its runs in memory."""
    from fogml.gap import diagnose
    from fogml.twin.twin_file import load_twin

    fit, held_out = ten_hour_runs(sample_s)
    twin = load_twin("nominal")
    begin = time.perf_counter()
    diagnose(twin, fit, [held_out], seed=1)
    return time.perf_counter() - begin


def subset(folder: Path, quick: bool) -> dict[str, Any]:
    """Figures and seconds a case of every way, on single missing effects of the development seed.

    The ways take turns on each case in this process, unsealed, so that all have loaded what they need.
    """
    from fogml.blind.folders import BlindFolder, case_files
    from fogml.blind.make import make_cases
    from fogml.blind.methods import load_method
    from fogml.blind.score import gather
    from fogml.blind.scoring.values import score_values

    count = 1 if quick else CASES
    make_cases(folder, count, CASE_SEED, workers=1, kinds=["one"])
    blind = BlindFolder(folder)
    wanted = {name: name for name in (OWN[-1:] if quick else OWN)}
    skipped = {}
    for name, (packages, method) in PEERS.items():
        reason = needs(*packages)()
        if reason:
            skipped[name] = reason
        elif not quick or name == "pysindy":
            wanted[name] = method
    methods = {name: load_method(text) for name, text in wanted.items()}
    spent: dict[str, list[float]] = {name: [] for name in methods}
    failures: dict[str, list[str]] = {name: [] for name in methods}
    for case in blind.names():
        files = case_files(blind.cases / case)
        for name, answer in methods.items():
            out = blind.answers(name) / case
            out.mkdir(parents=True)
            seconds, reason = answered(answer, files, out)
            if reason:
                failures[name].append(reason)
            else:
                spent[name].append(seconds)
    values = score_values(gather(blind, list(methods)))
    rows = []
    for name in methods:
        figures = {row["key"]: row["value"] for row in values["methods"][name]["rows"]}
        rows.append({"method": name, "seconds": spent[name], "failed": failures[name], "figures": figures})
    return {"cases": count, "seed": CASE_SEED, "rows": rows, "skipped": skipped}


def answered(answer: Callable[[Any, Path], Any], files: Any, out: Path) -> tuple[float, str | None]:
    """Let a method answer a case; its time [s], and why it failed, if it did."""
    from fogml.blind.folders import OUTCOME, OUTCOME_SCHEMA

    begin = time.perf_counter()
    reason = None
    try:
        answer(files, out)
    except Exception as error:  # A peer may fail in its own words; that is its result.
        reason = f"{type(error).__name__}: {error}"
    seconds = time.perf_counter() - begin
    outcome = {"schema": OUTCOME_SCHEMA, "case": files.name, "done": reason is None, "seconds": seconds}
    if reason is not None:
        outcome |= {"reason": "error", "message": reason}
    (out / OUTCOME).write_text(json.dumps(outcome) + "\n", encoding="utf-8")
    return seconds, reason


def measure(quick: bool, repeats: int, folder: Path) -> dict[str, Any]:
    """Everything of the section."""
    one_diagnosis(60.0)
    sizes = QUICK_TIMES if quick else TIMES
    spent: dict[int, list[float]] = {size: [] for size in sizes}
    for turn in range(repeats):
        for size in sizes if turn % 2 == 0 else sizes[::-1]:
            spent[size].append(one_diagnosis(2 * HOURS * 3600.0 / size))
    return {
        "ten_hours": [one_diagnosis(30.0 if quick else 1.0) for _ in range(repeats)],
        "sizes": list(sizes),
        "seconds": [spent[size] for size in sizes],
        "subset": subset(folder / "blind", quick),
    }


FIGURES = {
    "one_top": "one effect, d' > 10: top-1",
    "one_exact": "one effect, d' > 10: class exact",
    "two_exact": "two effects: class exact",
    "nothing_named": "nothing missing: named",
    "false_discovery": "named that are false",
    "unknown_wrong_name": "unknown: wrong name",
    "auroc": "open set AUROC",
    "calibration_error": "calibration error",
    "closed_ratio": "closed / true",
    "overlap": "overlap of segments",
}


def page(found: Mapping[str, Any]) -> str:
    """The section."""
    once = found["ten_hours"]
    medians = [statistics.median(times) for times in found["seconds"]]
    slope, error = exponent(found["sizes"], medians)
    last = (found["sizes"][-2:], medians[-2:])
    between = exponent(*last)[0]
    lines = [
        f"**Synthetic.** One diagnosis of two 10 h runs at 1 Hz with a third held out, every effect of the "
        f"catalogue a candidate: {statistics.median(once):.3g} s ({min(once):.3g}–{max(once):.3g}); "
        "wanted at most 10 s on 2 cores.",
        "",
        "| samples fitted | seconds |",
        "|---:|---:|",
        *[
            f"| {size:,} | {median:.3g} ({min(times):.3g}–{max(times):.3g}) |"
            for size, median, times in zip(found["sizes"], medians, found["seconds"])
        ],
        "",
        f"Exponent of time in samples: {slope:.2f} ± {error:.2f} over all, {between:.2f} between the two "
        f"largest. "
        "Runs are averaged before effects are compared, so most of the time does not grow.",
        "",
    ]
    part = found["subset"]
    lines += [
        "",
        f"Beside other ways on {part['cases']} blind cases of one missing effect (10 s samples, seed "
        f"{part['seed']}; too few to rank by, enough to see what each takes). `pysindy` is its ensemble "
        f"STLSQ over "
        "the catalogue's signatures; `sbi` is mixed neural posterior estimation over nothing or one effect.",
        "",
    ]
    seconds = {row["method"]: row["seconds"] for row in part["rows"]}
    lines += _figure_table({row["method"]: row["figures"] for row in part["rows"]}, seconds)
    for name, reason in part["skipped"].items():
        lines += ["", f"Skipped: {name}, {reason}."]
    return "\n".join(lines)


def _figure_table(methods: Mapping[str, Mapping[str, Any]], seconds: Mapping[str, list[float]]) -> list[str]:
    keys = [key for key in FIGURES if any(figures.get(key) is not None for figures in methods.values())]
    timed = ["median s a case"] if seconds else []
    lines = [f"| method | {' | '.join([*(FIGURES[k] for k in keys), *timed])} |"]
    lines.append("|---|" + "---:|" * (len(keys) + len(timed)))
    for name, figures in methods.items():
        cells = ["" if figures.get(k) is None else f"{figures[k]:.2f}" for k in keys]
        if seconds:
            cells.append(f"{statistics.median(seconds[name]):.3g}" if seconds[name] else "failed")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


DIAGNOSIS_STUDIES = (Study("diagnosis", "diagnosis", measure, page),)
