"""C of three axes in one file: each axis' code as it was checked alone, its names told apart by the axis."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fogml.errors import InputError
from fogml.escaping import CCode
from fogml.export.c_float import literal, sensor_identifier
from fogml.export.c_program import run_self_test, write_files
from fogml.export.c_source import HEADER, SOURCE, project_files, templates
from fogml.export.documentation import DOCUMENTATION_FILE
from fogml.export.export import export_model
from fogml.export.losses import runs_of_each
from fogml.export.plan import Plan
from fogml.export.self_test import sum_of_reals
from fogml.export.settings import SCHEMA, ExportSettings, report_tail
from fogml.export.tables import by_axis, read_matrix
from fogml.models.base import DriftModel
from fogml.outputs import scratch_folder
from fogml.runs.run import Run

NAME = "fogml_axes"
SHARED = frozenset({"FOGML_CLOCK_32", "FOGML_NO_SELF_TEST"})
"""What whoever compiles defines, for all axes."""
_DEFINED = re.compile(
    r"^#define (\w+)(?: (\w+_clock_32)$)?|^\} (\w+);|^typedef \w+ (\w+);"
    r"|^(?:static )?(?:const )?\w+ \*?(\w+)\(|^static const \w+ (\w+)\[",
    re.MULTILINE,
)
_INCLUDE = re.compile(r"^#include .*\n", re.MULTILINE)
_WORD = re.compile(r"\b[A-Za-z_]\w*\b")


@dataclass(frozen=True)
class AxisCode:
    """The generated C of one axis, and places of its inputs among those of all."""

    axis: str
    header: str
    source: str
    places: tuple[tuple[str, str], ...]


def export_axes(
    models: Sequence[DriftModel],
    folder: Path,
    settings: ExportSettings,
    train: Sequence[Run] = (),
    matrix: Path | None = None,
) -> dict[str, Any]:
    """Write the models of two or three axes of one unit as one C file, once each has been checked alone.

    Parameters
    ----------
    models
        One an axis, each of which states its axis.
    folder
        An existing folder.
    settings
        What is wanted; ``to`` is ``c``.
    train
        Training runs of the models; may be left out.
    matrix
        File with a 3 x 3 matrix that takes compensated outputs to the body's axes; None for none.

    Returns
    -------
    dict
        The content of ``export.json``: ``axes``, by axis what an export of it alone says.

    Raises
    ------
    InputError
        As `export_model`, and if the models are not of different axes of one unit.
    """
    named = by_axis(models)
    fixed = settings.dtype in ("q15", "q31")
    if matrix is not None and fixed:
        raise InputError(
            "--matrix: in fixed point each axis is a call of its own, which knows no other; use --dtype "
            "float32 or float64"
        )
    rows = None if matrix is None else read_matrix(matrix, len(named)).tolist()
    reports, codes, sensors = {}, [], []
    for (axis, model), runs in zip(named.items(), runs_of_each([*named.values()], train), strict=True):
        with scratch_folder() as alone:
            try:
                reports[axis] = export_model(model, alone, settings, runs)
            except InputError as problem:
                raise InputError(f"axis {axis}: {problem}") from None
            (folder / f"{axis}-{DOCUMENTATION_FILE}").write_bytes((alone / DOCUMENTATION_FILE).read_bytes())
            inputs = Plan.of(model, settings.sample_s).sensors
            codes.append(_code_of(axis, alone, inputs))
        sensors += [name for name in inputs if name not in sensors]
    files = axes_source(codes, sensors, rows, fixed=fixed, dtype=settings.dtype)
    with scratch_folder() as scratch:
        if run_self_test(files, f"{NAME}.h", f"{NAME}_self_test", f"{NAME}.c", scratch) != 0:
            raise InputError("export: the generated C of all axes fails its own self-test on this machine")
    write_files({**files, **project_files(NAME)}, folder)
    return {
        "schema": SCHEMA,
        "to": "c",
        "dtype": next(iter(reports.values()))["dtype"],
        "unit": "deg/h",
        "inputs": sensors,
        **({} if rows is None else {"matrix": rows}),
        "axes": {axis: {k: v for k, v in told.items() if k != "files"} for axis, told in reports.items()},
        **report_tail(folder),
    }


def _code_of(axis: str, folder: Path, sensors: Sequence[str]) -> AxisCode:
    header, source = ((folder / name).read_text(encoding="utf-8") for name in (HEADER, SOURCE))
    names = {name for found in _DEFINED.findall(header + source) for name in found if name} - SHARED
    own = {name: of_axis(name, axis) for name in names}

    def told_apart(text: str) -> str:
        return _WORD.sub(lambda word: own.get(word[0], word[0]), text)

    # The file of all axes includes what they need, once.
    header, source = (_INCLUDE.sub("", text) for text in (header, source))
    places = tuple((of_axis(sensor_identifier(name), axis), of_axes(name)) for name in sensors)
    return AxisCode(axis, told_apart(header), told_apart(source), places)


def of_axis(name: str, axis: str) -> str:
    """A name of generated C as that of one axis: ``fogml_x_step``, ``FOGML_X_T``, ``x_limited``."""
    letter = axis.upper() if name.isupper() else axis
    for head in ("fogml_", "FOGML_"):
        if name.startswith(head):
            return f"{head}{axis.upper() if head.isupper() else axis}_{name[len(head) :]}"
    return f"{letter}_{name}"


def of_axes(sensor: str) -> str:
    """The identifier of a column's place in the array that all axes share."""
    return sensor_identifier(sensor).replace("FOGML_", "FOGML_AXES_", 1)


def axes_source(
    codes: Sequence[AxisCode],
    sensors: Sequence[str],
    matrix: Sequence[Sequence[float]] | None = None,
    *,
    fixed: bool,
    dtype: str | None,
) -> Mapping[str, str]:
    """Header and source of all axes, by file name."""
    kind = dtype or "float32"
    context = {
        "matrix": [", ".join(literal(value, kind) for value in row) for row in matrix or ()],
        "matrix_sum": 0 if matrix is None else sum_of_reals(matrix, kind),
        "axes": [code.axis for code in codes],
        "codes": [CCode(code.header) for code in codes],
        "sources": [CCode(code.source) for code in codes],
        "places": {code.axis: [tuple(map(CCode, pair)) for pair in code.places] for code in codes},
        "sensors": [CCode(of_axes(name)) for name in sensors],
        "fixed": fixed,
        "real": CCode("double" if dtype == "float64" else "float"),
        "zero": literal(0.0, kind) if not fixed else "0",
    }
    return {f"{NAME}.{end}": templates().get_template(f"axes.{end}.j2").render(context) for end in ("h", "c")}
