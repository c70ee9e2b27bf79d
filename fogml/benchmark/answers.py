"""Entries, and what one answers to a drift case: by a method or by hand, read with every fault told."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fogml.arrays import FloatArray
from fogml.benchmark.rounds import ANSWER, Track, TrackFolder, read_round
from fogml.blind.folders import OUTCOME, CaseFiles, read_json
from fogml.blind.run import RunPlan
from fogml.blind.worker import own_roots, within
from fogml.errors import InputError
from fogml.json_files import write_json
from fogml.models.base import DriftModel
from fogml.models.names import make_model
from fogml.models.regressors import own_regressor, own_regressors
from fogml.runs.reading import read_run
from fogml.validation.run_errors import run_errors

HEADER = ("drift [deg/h]", "half_width [deg/h]")
ABOUT = "about.json"
"""What a method tells beside its answer: ``bytes`` of what it would carry into firmware."""
_DIGITS = "%.10g"
_MOST_BYTES_A_ROW = 128
"""Two numbers of all their digits take under 60 bytes; what is larger is no answer and is not read."""
_BELOW = 1e100
"""Of any number's size [deg/h]: squares of larger ones and their sums are no longer finite."""


@dataclass(frozen=True)
class DriftAnswer:
    """The drift at each sample of a held-out run [deg/h], and half-widths of its 90 % interval if told.

    ``failure`` says why a method gave none.
    """

    drift: FloatArray | None = None
    half_width: FloatArray | None = None
    bytes: int | None = None
    failure: str = ""


def drift_model(case: CaseFiles, out: Path, *, model: str = "auto", features: str | None = None) -> None:
    """Answer a case by a drift model of fogml, or a regressor of scikit-learn, by its name."""
    answer_by(make_model(model, features, case.seed), case, out)


def answer_by(model: DriftModel, case: CaseFiles, out: Path) -> None:
    """Fit any drift model to the training runs of a case, and write what it says of the held-out run."""
    model.fit([read_run(path) for path in case.fit])
    found = run_errors(model, read_run(case.held_out[0]))
    # A model without intervals of its own tells none.
    told = found.half_width if np.any(found.half_width > 0.0) else None
    write_drift(out, found.drift, told, model.weight_bytes() or None)


def write_drift(
    out: Path, drift: FloatArray, half_width: FloatArray | None = None, bytes: int | None = None
) -> None:
    """Write an answer into the folder of a case.

    Parameters
    ----------
    out
        The folder.
    drift
        What is to be taken from the output at each sample, its constant included [deg/h], shape (n,).
    half_width
        Half-widths of the 90 % interval of the drift's averages [deg/h], shape (n,).
    bytes
        Size of the model that gave it.
    """
    columns = [drift] if half_width is None else [drift, half_width]
    header = ",".join(HEADER[: len(columns)])
    np.savetxt(out / ANSWER["drift"], np.column_stack(columns), _DIGITS, ",", header=header, comments="")
    if bytes is not None:
        write_json(out / ABOUT, {"bytes": bytes})


def read_drift(folder: Path, samples: int) -> DriftAnswer:
    """The answer in the folder of a case, to a held-out run of so many samples.

    Raises
    ------
    InputError
        If it is missing, of another length, or not a finite number somewhere; names file, column and row.
    """
    path = folder / ANSWER["drift"]
    outcome = read_json(folder / OUTCOME) if (folder / OUTCOME).is_file() else {}
    if outcome.get("done") is False:
        return DriftAnswer(failure=f"{outcome.get('reason')}: {outcome.get('message')}")
    if not path.is_file():
        raise InputError(f"{path}: no such file; every case needs an answer")
    if path.stat().st_size > _MOST_BYTES_A_ROW * (samples + 1):
        raise InputError(
            f"{path}: is larger than {samples} rows can be; expected one row for each of held-out-1.csv"
        )
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    cells = tuple(cell.strip() for cell in lines[0].split(",")) if lines else ()
    if cells not in (HEADER, HEADER[:1]):
        expected = f"'{','.join(HEADER)}', the second column if there are intervals"
        raise InputError(f"{path}, row 1: the header is '{','.join(cells)[:80]}', expected {expected}")
    if len(lines) - 1 != samples:
        raise InputError(
            f"{path}: {len(lines) - 1} rows below the header, expected {samples}: one for each row of "
            "held-out-1.csv"
        )
    values = _numbers(lines[1:], cells, path)
    about = read_json(folder / ABOUT) if (folder / ABOUT).is_file() else {}
    told = about.get("bytes")
    if told is not None and not (isinstance(told, int) and told >= 0):
        raise InputError(f"{folder / ABOUT}: key 'bytes' is {told!r}, expected a whole number of bytes")
    return DriftAnswer(values[:, 0], values[:, 1] if len(cells) > 1 else None, told)


def _numbers(lines: list[str], cells: tuple[str, ...], path: Path) -> FloatArray:
    """Rows of finite numbers; a fault is told by its column and row."""
    try:
        values = np.loadtxt(lines, delimiter=",", ndmin=2, comments=None)
    except ValueError:
        values = np.empty((0, 0))
    sound = values.shape == (len(lines), len(cells)) and bool(np.all(np.abs(values) < _BELOW))
    if sound and not np.any(values[:, 1:] < 0.0):
        return values
    for row, line in enumerate(lines, start=2):
        _check_row(line, cells, path, row)
    raise InputError(f"{path}: the rows are not numbers separated by commas")


def _check_row(line: str, cells: tuple[str, ...], path: Path, row: int) -> None:
    parts = line.split(",")
    if len(parts) != len(cells):
        raise InputError(f"{path}, row {row}: {len(parts)} cells, expected {len(cells)}")
    for text, cell in zip(parts, cells):
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        if not abs(value) < _BELOW or (cell == HEADER[1] and value < 0.0):
            least = ", not below 0" if cell == HEADER[1] else ""
            least += f", its size below {_BELOW:g}" if np.isfinite(value) and value >= 0.0 else ""
            raise InputError(
                f"{path}, column '{cell}', row {row}: '{text.strip()[:40]}', expected a finite number{least}"
            )


def _folder_of(name: str) -> Path | None:
    """Where the package lies that declares a regressor, if a sealed process can't read it by itself."""
    if name not in own_regressors():
        return None
    top = sys.modules[own_regressor(name).__module__.partition(".")[0]]
    if top.__file__ is None or within(top.__file__, own_roots()):
        return None
    return Path(top.__file__).parents[1 if hasattr(top, "__path__") else 0]


_DRIFT_MODEL = "fogml.benchmark.answers:drift_model"


def entry_name(method: str, name: str | None = None) -> str:
    """What the answers of a method are called: its name, without the module of a function or regressor."""
    return name or method.rpartition(":")[2].rpartition(".")[2]


def entry_plan(
    directory: str | Path,
    track: Track,
    method: str,
    *,
    name: str | None = None,
    features: str | None = None,
    code: Path | None = None,
    workers: int = 1,
    limit_s: float = 600.0,
    retry: bool = False,
    seed: int = 0,
) -> RunPlan:
    """How a method answers a track.

    Parameters
    ----------
    directory
        The round, or what was handed out of it as ``handout`` in a folder.
    track
        ``drift`` or ``diagnosis``.
    method
        Of the drift track a model's name, of the diagnosis track that of a method of ``fogml blind run``; of
        both ``module:function``, called with the case's files and the folder for its answer.
    name
        What its answers are called.
    features
        Of a drift model by its name.
    code
        Folder of the method's own code, where that is not installed.
    workers, limit_s, retry, seed
        As of `fogml.blind.run.RunPlan`.
    """
    read_round(directory)
    by_name = track == "drift" and ":" not in method
    if by_name:
        from fogml.models.names import make_model

        make_model(method, features)  # a name that is not known is told before any process begins
        code = code or _folder_of(method)
    folder = TrackFolder(Path(directory), track)
    called = entry_name(method, name)
    return RunPlan(
        folder=folder,
        method=_DRIFT_MODEL if by_name else method,
        name=called,
        code=code,
        workers=workers,
        limit_s=limit_s,
        retry=retry,
        into=folder.answers(called),
        seed=seed,
        options={"model": method, "features": features} if by_name else {},
        answer=ANSWER[track],
    )
