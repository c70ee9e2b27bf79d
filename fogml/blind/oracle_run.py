"""Answers of the oracle, which alone is given the truth: in processes of its own, not sealed."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import Any

from fogml.blind.code_state import code_state
from fogml.blind.folders import OUTCOME, BlindFolder
from fogml.blind.methods import ORACLE
from fogml.blind.run import Progress, RunPlan, case_stamp, count_samples, outcome_of
from fogml.json_files import write_json
from fogml.outputs import whole_folder
from fogml.processes import in_processes


def run_oracle(plan: RunPlan, progress: Progress | None = None) -> tuple[int, int]:
    """Answer the cases that are left; returns how many were answered now, and how many failed."""
    left = plan.left()
    plan.answers.mkdir(parents=True, exist_ok=True)
    if not left:
        return 0, 0
    failed, code = 0, code_state(ORACLE)
    answer = partial(_one, plan.folder.path, plan.answers, code)
    for name, done in in_processes(answer, left, plan.workers):
        failed += not done
        if progress:
            progress(name)
    return len(left), failed


def _one(path: Path, answers: Path, code: str, name: str) -> tuple[str, bool]:
    from fogml.blind.baselines.oracle import oracle
    from fogml.blind.truth import read_truth

    folder = BlindFolder(path)
    began = time.perf_counter()
    answer: dict[str, Any] = {"done": True, "reason": None, "message": ""}
    with whole_folder(answers, shared=True) as staging:
        out = staging / name
        out.mkdir()
        try:
            oracle(folder, read_truth(folder.truth / f"{name}.json"), out)
        except Exception as error:
            answer = {"done": False, "reason": "error", "message": f"{type(error).__name__}: {error}"}
        answer["seconds"] = time.perf_counter() - began
        samples = count_samples(folder.cases / name)
        files = case_stamp(folder.cases / name)
        values = outcome_of(name, ORACLE, answer, "not sealed: it is given the truth", samples, code, files)
        write_json(out / OUTCOME, values, indent=1)
    return name, bool(answer["done"])
