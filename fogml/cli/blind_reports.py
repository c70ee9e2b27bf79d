"""Reports of the worst cases of a blind suite: drawn, and linked to from its score."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fogml.blind.folders import DIAGNOSIS, BlindFolder
from fogml.cli.terminal import Terminal

_REPORTS = "reports"


def draw_reports(folder: BlindFolder, worst: list[dict[str, Any]], seed: int, terminal: Terminal) -> None:
    """Diagnose the worst cases once more, to draw their pages into the suite's folder ``reports``."""
    from fogml.blind.run import RunPlan, run_cases

    names = tuple(case["case"] for case in worst if case["verdict"] != "failed")
    method = "fogml.report.gap_page:diagnosis_with_page"
    reports = folder.path / _REPORTS
    for name in names:
        held, answer = (place / name / "gap.json" for place in (reports, folder.answers()))
        # A page of an answer that was given anew since is another one's.
        if held.is_file() and held.read_bytes() != answer.read_bytes():
            shutil.rmtree(held.parent)
    plan = RunPlan(folder, method, name=DIAGNOSIS, only=names, into=reports, retry=True, seed=seed)
    with terminal.work("drawing the worst cases", total=len(plan.left())) as work:
        run_cases(plan, lambda case: work.advance(doing=f"drawing {case}"))


def link_reports(values: dict[str, Any], folders: Sequence[Path], out: Path) -> None:
    """Say of each worst case where its report lies, relative to the folder `out` of the score.

    That is the diagnosis's page where it was drawn, else the answer, else None.

    Parameters
    ----------
    values
        Schema ``fogml.blind_score/1``; the cases' ``report`` is set.
    folders
        Of the suite's parts; those that are not there, as they may be on another machine, hold nothing.
    """
    for method, found in values["methods"].items():
        for case in found["worst"]:
            places = (_reports(BlindFolder(folder), method, case["case"]) for folder in folders)
            report = next((path for held in places for path in held if path.is_file()), None)
            case["report"] = report and Path(os.path.relpath(report, out)).as_posix()


def _reports(folder: BlindFolder, method: str, case: str) -> list[Path]:
    drawn = [folder.path / _REPORTS / case / "gap.html"] if method == DIAGNOSIS else []
    return [*drawn, *(folder.answers(method) / case / f"{name}.json" for name in ("gap", "outcome"))]
