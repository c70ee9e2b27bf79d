"""What the experiments on a suite share: a measurement of every case, and runs as one sees them who knows."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from joblib import Parallel, delayed

from fogml.gap.blind.folders import BlindFolder, case_files
from fogml.gap.blind.truth import Truth
from fogml.gap.frame import Frame
from fogml.gap.observation import observe
from fogml.gap.run_whitener import RunWhitener
from fogml.gap.twin_model import TwinModel
from fogml.outputs import whole_file
from fogml.runs.reading import read_run

HERE = Path(__file__).parent
Found = TypeVar("Found")


def measure_cases(
    measured: Callable[[BlindFolder, str], Found], words: str | None, suite: str
) -> list[Found]:
    """What `measured` finds of each case of the suite that the command line names.

    Parameters
    ----------
    measured
        Takes the suite's folder and a case's name.
    words
        What the command does.
    suite
        What the suite has to be.
    """
    parser = argparse.ArgumentParser(description=words, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("directory", help=suite)
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    given = parser.parse_args()
    folder = BlindFolder(Path(given.directory))
    return list(Parallel(n_jobs=given.workers)(delayed(measured)(folder, name) for name in folder.names()))


def write_tables(name: str, content: Any, page: str) -> None:
    """Write ``name.json`` and ``name.md`` beside the experiments."""
    with whole_file(HERE / f"{name}.json") as partial:
        partial.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    with whole_file(HERE / f"{name}.md") as partial:
        partial.write_text(page, encoding="utf-8")


def true_frame(folder: BlindFolder, truth: Truth, model: TwinModel) -> Frame:
    """The fit runs of a case, whitened by the true noise, at the true nominal constants."""
    runs = [observe(read_run(path), model) for path in case_files(folder.cases / truth.case).fit]
    whiteners = [RunWhitener(truth.noise_model, o, truth.nominal) for o in runs]
    return Frame(runs, whiteners, model.constants, truth.nominal)
