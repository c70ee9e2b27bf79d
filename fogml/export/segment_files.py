"""Tables over temperature as CSV, JSON and C, the C compiled and compared before it is kept."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.export.c_program import compiled_output, write_files
from fogml.export.c_source import project_files, templates
from fogml.export.segments import Segments
from fogml.json_files import write_json
from fogml.numerals import ascii_number
from fogml.outputs import scratch_folder

SCHEMA = "fogml.segments/1"
CSV_FILE, JSON_FILE = "fogml_segments.csv", "fogml_segments.json"
HEADER, SOURCE, DRIVER = "fogml_segments.h", "fogml_segments.c", "driver.c"
FORMULA = (
    "compensated = scale(T) output - bias(T); bias and scale on straight lines between the breakpoints, held "
    "at the ends"
)
_BYTES = {"float32": 4, "float64": 8}
_CHECKED = 2000
"""Temperatures at which the C is compared."""
_ROUNDING = {"float32": 1e-5, "float64": 1e-12}
"""Difference of the C allowed, as a share of the largest number in it: eighty roundings of its format."""


def write(
    folder: Path,
    tables: Mapping[str, Segments],
    matrix: FloatArray | None,
    cards: Mapping[str, Mapping[str, Any]],
    losses: Mapping[str, Mapping[str, Any] | None],
    dtype: str,
) -> dict[str, dict[str, Any]]:
    """Write the tables of some axes, and tell of each what it holds and loses.

    Parameters
    ----------
    folder
        An existing folder.
    tables
        By axis.
    matrix
        3 x 3, what compensated outputs are multiplied with; None for none.
    cards, losses
        By axis: what the model is, and what the table loses on its training runs.
    dtype
        Number format of the C.

    Raises
    ------
    InputError
        If the C does not compute the table.
    """
    several = len(tables) > 1
    for axis, table in tables.items():
        name = CSV_FILE.replace(".csv", f"_{axis}.csv") if several else CSV_FILE
        (folder / name).write_text(_csv(table), encoding="ascii")
    scaled = any(map(has_scale, tables.values()))
    told = {axis: _told(table, losses[axis], dtype, scaled) for axis, table in tables.items()}
    document = {
        "schema": SCHEMA,
        "formula": FORMULA,
        "unit": "deg/h",
        "scaled": scaled,
        "matrix": None if matrix is None else matrix.tolist(),
        "axes": {
            axis: {
                "thermometer": table.thermometer,
                "output_unit": table.gyro_unit,
                "temperature_degc": table.temperature.tolist(),
                "bias_deg_h": table.bias.tolist(),
                "scale": table.scale.tolist(),
                "card": dict(cards[axis]),
                **told[axis],
            }
            for axis, table in tables.items()
        },
    }
    write_json(folder / JSON_FILE, document, indent=1)
    files = _source(tables, matrix, cards, dtype)
    difference = _difference(files, tables, matrix, dtype)
    kept = {name: files[name] for name in (HEADER, SOURCE)}
    write_files({**kept, **project_files("fogml_segments")}, folder)
    return {axis: {**values, "c_largest_difference": difference} for axis, values in told.items()}


def has_scale(table: Segments) -> bool:
    """Whether the table holds a scale factor of its own."""
    return not bool(np.all(table.scale == 1.0))


def _told(table: Segments, loss: Mapping[str, Any] | None, dtype: str, scaled: bool) -> dict[str, Any]:
    return {
        "breakpoints": len(table.temperature),
        "bytes": (3 if scaled else 2) * len(table.temperature) * _BYTES[dtype],
        "rms_difference_at_rest": table.rms,
        "largest_difference_at_rest": table.largest,
        "scale_factor_weighed_at_deg_s": table.rate_deg_s,
        "accuracy": None if loss is None else dict(loss),
    }


def _csv(table: Segments) -> str:
    columns = [table.temperature, table.bias, table.scale][: 3 if has_scale(table) else 2]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    header = [f"{table.thermometer} [degC]", "bias [deg/h]", f"scale [deg/h per {table.gyro_unit}]"]
    lines = [",".join(header[: len(columns)])]
    return "\n".join([*lines, *(",".join(repr(value) for value in row) for row in rows)]) + "\n"


def _source(
    tables: Mapping[str, Segments],
    matrix: FloatArray | None,
    cards: Mapping[str, Mapping[str, Any]],
    dtype: str,
) -> dict[str, str]:
    """Header, source and the driver that feeds it, by name."""
    card = []
    for axis, table in tables.items():
        own = cards[axis]
        card += [
            f"axis {axis}: {own['unit'] or 'unit not stated'}, {own['kind']} over {table.thermometer}, "
            f"{table.temperature[0]:.6g} to {table.temperature[-1]:.6g} degC",
            f"  off from the model at rest by {ascii_number(table.largest)} deg/h at most",
            *(f"  trained on {run['name']}, SHA-256 {run['sha256']}" for run in own["training_runs"]),
        ]
    context = {
        "card": card,
        "real": "float" if dtype == "float32" else "double",
        "zero": _literals([0.0], dtype)[0],
        "scaled": any(map(has_scale, tables.values())),
        "matrix": None if matrix is None else [_literals(row, dtype) for row in matrix],
        "axes": {
            axis: {
                "count": len(table.temperature),
                "thermometer": table.thermometer,
                "unit": table.gyro_unit,
                **{name: _literals(getattr(table, name), dtype) for name in ("temperature", "bias", "scale")},
            }
            for axis, table in tables.items()
        },
    }
    names = {HEADER: "segments.h.j2", SOURCE: "segments.c.j2", DRIVER: "segments_driver.c.j2"}
    return {name: templates().get_template(template).render(context) for name, template in names.items()}


def _literals(values: Iterable[float], dtype: str) -> list[str]:
    """Numbers as C reads them back exactly."""
    kind, suffix = (np.float32, "F") if dtype == "float32" else (np.float64, "")
    texts = [np.format_float_scientific(kind(value), unique=True, trim="0") for value in values]
    return [text + suffix for text in texts]


def _difference(
    files: Mapping[str, str], tables: Mapping[str, Segments], matrix: FloatArray | None, dtype: str
) -> float:
    """Largest difference of the compiled C from the tables [deg/h], inside of them and out."""
    rng = np.random.default_rng(0)
    ends = [(table.temperature[0] - 5.0, table.temperature[-1] + 5.0) for table in tables.values()]
    temperature = np.column_stack([rng.uniform(low, high, _CHECKED) for low, high in ends])
    size = np.array([36000.0 / np.abs(table.scale).mean() for table in tables.values()])
    output = rng.uniform(-1.0, 1.0, temperature.shape) * size
    given = np.stack([temperature, output], axis=1).astype(dtype)
    with scratch_folder() as scratch:
        told = compiled_output(files, DRIVER, scratch, given.tobytes())
    out = np.frombuffer(told, dtype=dtype).reshape(temperature.shape).astype(np.float64)
    own = np.empty(temperature.shape)
    for i, table in enumerate(tables.values()):
        bias, scale = table.at(given[:, 0, i].astype(np.float64))
        own[:, i] = scale * given[:, 1, i] - bias
    wanted = own if matrix is None else own @ matrix.T
    off = np.abs(out - wanted)
    if not np.all(off <= _ROUNDING[dtype] * (np.abs(wanted).max() + 1.0)):
        raise InputError("export: the generated C does not compute its own table on this machine")
    return float(off.max())
