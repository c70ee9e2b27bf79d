"""What an export is asked for, and how far it may be from its model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from fogml import __version__
from fogml.errors import InputError, known_are
from fogml.export.c_source import C_DTYPES
from fogml.export.check import TURN_DEG_H, Difference
from fogml.export.plan import Plan
from fogml.export.storage import FILE_DTYPES
from fogml.intervals import LEVEL
from fogml.models.base import DriftModel
from fogml.numerals import against, short

SCHEMA = "fogml.export/1"
Target = Literal["c", "onnx", "json", "mat"]
TARGETS: tuple[str, ...] = get_args(Target)
TABLE_TARGETS = ("segments", "px4", "ardupilot")
ALL_TARGETS = (*TARGETS, *TABLE_TARGETS)
"""What `fogml.export.tables` writes."""
DTYPES = ("float64", "float32", "float16", "int8", "q15", "q31")
TOLERANCE_SHARE = {"float64": 1e-4, "float32": 0.01, "q31": 0.02, "q15": 0.05, "float16": 0.05, "int8": 0.5}
"""Difference allowed unless stated, as a share of the model's 90 % interval half-width."""
BINNED_SHARE = 5e-3
"""The same where windows keep samples in bins: a bin that a window's edge parts is parted along a line."""
_MOST_SCALE_PPM = 1.0
"""... of a scale factor, or what makes as much as the tolerance at 10 deg/s."""


@dataclass(frozen=True)
class ExportSettings:
    """What is wanted.

    Attributes
    ----------
    to
        ``c``, ``onnx``, ``json`` or ``mat``.
    dtype
        Number format; None: ``float32`` for C, else ``float64``.
    budget
        Most bytes that the numbers may take; None for all of them.
    tolerance
        Largest difference from the model allowed [deg/h]; None: a share of the model's interval.
    pipeline
        Of ONNX: from the temperatures' window instead of features.
    sample_s
        Sample interval to run at [s]; None: that of training.
    seed
        Seed of the points that are compared.
    """

    to: str = "c"
    dtype: str | None = None
    budget: int | None = None
    tolerance: float | None = None
    pipeline: bool = False
    sample_s: float | None = None
    seed: int = 0


def tolerance_of(model: DriftModel, settings: ExportSettings, dtype: str, binned: bool = False) -> float:
    if settings.tolerance is not None:
        return settings.tolerance
    share = max(TOLERANCE_SHARE[dtype], BINNED_SHARE if binned else 0.0)
    return share * float(model.intervals_.half_width(LEVEL))


def check_settings(settings: ExportSettings, dtype: str) -> None:
    if settings.to not in TARGETS:
        known = known_are(settings.to, ALL_TARGETS)
        raise InputError(f"--to '{settings.to}' is not known; {known}")
    if dtype not in DTYPES:
        raise InputError(f"--dtype '{dtype}' is not known; {known_are(dtype, DTYPES)}")
    allowed = C_DTYPES if settings.to == "c" else FILE_DTYPES
    if dtype not in allowed:
        other = "for --to onnx, json and mat" if settings.to == "c" else "for --to c"
        raise InputError(f"--dtype {dtype} is {other}; --to {settings.to} takes {', '.join(allowed)}")
    if settings.pipeline and settings.to != "onnx":
        raise InputError("--with-pipeline is for --to onnx; C code always takes raw temperatures")
    if settings.budget is not None and settings.budget < 1:
        raise InputError(f"--bytes {settings.budget}: a positive number was expected")
    if settings.tolerance is not None and not 0.0 <= settings.tolerance < np.inf:
        raise InputError(f"--tolerance {settings.tolerance}: a number of deg/h from 0 was expected")


def hold_within(
    total: float, difference: Difference, tolerance: float, settings: ExportSettings, dtype: str
) -> None:
    if not total <= tolerance:
        ways = [] if dtype == "float64" else ["choose a finer --dtype"]
        ways += [] if settings.budget is None else ["allow more --bytes"]
        ways.append("state --tolerance if that is good enough")
        raise InputError(
            f"export: in {dtype} the model's output differs by up to {against(total, tolerance)} deg/h from "
            f"the model's, more than the tolerance of {short(tolerance)} deg/h; {', or '.join(ways)}. "
            "Nothing was written"
        )
    ppm, most = difference.scale_ppm, max(_MOST_SCALE_PPM, 1e6 * tolerance / TURN_DEG_H)
    if ppm is not None and settings.tolerance is None and ppm > most:
        raise InputError(
            f"export: in {dtype} the scale factor differs by up to {against(ppm, most)} ppm, more than "
            f"{short(most)} ppm; choose a finer --dtype, or state --tolerance. Nothing was written"
        )


def report_head(
    settings: ExportSettings,
    dtype: str,
    plan: Plan,
    difference: Difference,
    tolerance: float,
    *,
    weight_bytes: int,
    operations: int | None,
) -> dict[str, Any]:
    """What ``export.json`` begins with, of whatever form."""
    return {
        "schema": SCHEMA,
        "to": settings.to,
        "dtype": dtype,
        "bytes_weights": weight_bytes,
        **difference.as_dict(),
        "tolerance": tolerance,
        "unit": "deg/h",
        "operations_per_sample": operations,
        "model": {"kind": plan.kind, "features": list(plan.names), "centres": plan.centres},
        "sensors": list(plan.sensors),
        "sample_s": plan.sample_s,
    }


def report_tail(folder: Path) -> dict[str, Any]:
    """What ``export.json`` ends with: the files that are written so far, and the version."""
    return {"files": sorted(path.name for path in folder.iterdir()), "fogml_version": __version__}
