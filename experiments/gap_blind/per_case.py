"""What the experiments on a suite share: a measurement of every case, and runs as one sees them who knows."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from fogml.blind.folders import BlindFolder, case_files
from fogml.blind.truth import FloatArray, Truth, read_contributions, read_truth
from fogml.gap.frame import Frame
from fogml.gap.observation import observe
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.twin_model import TwinModel
from fogml.outputs import whole_file
from fogml.runs.reading import read_run

HERE = Path(__file__).parent


class Measured(NamedTuple):
    """What was measured of each case of a seed, of every part that was."""

    seed: int
    cases: list[Any]


def measure_cases(
    name: str, measured: Callable[[BlindFolder, str], Any], words: str | None, suite: str
) -> Measured:
    """What `measured` finds of each case of a suite, and what was found of other parts of its seed before.

    A part's findings are kept beside the experiments as ``name-FOLDER.json``.

    Parameters
    ----------
    name
        Of the experiment.
    measured
        Takes the suite's folder and a case's name; what it gives is JSON-ready.
    words
        What the command does.
    suite
        What the suite that the command line names has to be.
    """
    parser = argparse.ArgumentParser(description=words, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("directory", help=suite)
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    given = parser.parse_args()
    folder = BlindFolder(Path(given.directory))
    names = folder.names()
    found = list(Parallel(n_jobs=given.workers)(delayed(measured)(folder, case) for case in names))
    seed = read_truth(folder.truth / f"{names[0]}.json").seed
    _keep(name, folder.path.resolve().name, {"seed": seed, "cases": found})
    return Measured(seed, of_seed(name, seed))


def _keep(name: str, part: str, content: Any) -> None:
    with whole_file(HERE / f"{name}-{part}.json") as partial:
        partial.write_text(json.dumps(content, separators=(",", ":")) + "\n", encoding="utf-8")


def of_seed(name: str, seed: int) -> list[Any]:
    """What was measured of every part of a seed."""
    parts = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(HERE.glob(f"{name}-*.json"))]
    return [case for part in parts if part["seed"] == seed for case in part["cases"]]


def write_page(name: str, page: str) -> None:
    """Write ``name.md`` beside the experiments."""
    with whole_file(HERE / f"{name}.md") as partial:
        partial.write_text(page, encoding="utf-8")


def true_frame(folder: BlindFolder, truth: Truth, model: TwinModel) -> Frame:
    """The fit runs of a case, whitened by the true noise, at the true nominal constants."""
    runs = [observe(read_run(path), model) for path in case_files(folder.cases / truth.case).fit]
    whiteners = [RunWhitener(truth.noise_model, o, truth.nominal) for o in runs]
    return Frame(runs, whiteners, model.constants, truth.nominal)


def true_forms(folder: BlindFolder, truth: Truth, frame: Frame) -> FloatArray:
    """What each effect of a case truly makes, whitened, shape (n, effects)."""
    given = read_contributions(folder.truth / f"{truth.case}.npz")
    count = range(len(truth.effects))
    return frame.white(
        [np.column_stack([o.averaged(given[o.run.name, i]) for i in count]) for o in frame.observations]
    )
