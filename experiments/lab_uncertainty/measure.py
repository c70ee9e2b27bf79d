"""How often stated intervals hold the truth, and how far estimates are off in standard errors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fogml.intervals import Z90


@dataclass(frozen=True)
class Told:
    """One estimate: off the truth by `error`, with 90 % half-width `half` (None where none is stated).

    `held` says whether an interval that need not be even about the estimate holds the truth; None of others.
    """

    error: float
    half: float | None
    held: bool | None = None


def of_errors(error: float, se: float | None) -> Told:
    """An estimate that is stated with a standard error."""
    return Told(error, None if se is None else Z90 * se)


def of_interval(value: float, truth: float, ends: tuple[float, float] | None) -> Told:
    """An estimate that is stated with a 90 % interval about it."""
    if ends is None:
        return Told(value - truth, None)
    return Told(value - truth, 0.5 * (ends[1] - ends[0]), ends[0] <= truth <= ends[1])


def wilson(part: int, whole: int, z: float = 1.96) -> tuple[float, float]:
    """95 % interval of a share (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927)."""
    share = part / whole
    middle = (share + z * z / (2.0 * whole)) / (1.0 + z * z / whole)
    half = z / (1.0 + z * z / whole) * np.sqrt(share * (1.0 - share) / whole + (z / (2.0 * whole)) ** 2)
    return max(float(middle - half), 0.0), float(middle + half)


def coverage(case: str, quantity: str, told: Iterable[Told | None]) -> dict[str, Any]:
    """The row of a case: coverage with Wilson's interval, mean and rms of errors over standard errors."""
    every = list(told)
    found = [one for one in every if one is not None and one.half is not None]
    row: dict[str, Any] = {"case": case, "quantity": quantity, "runs": len(every), "stated": len(found)}
    if not found:
        return row | {"held": None}
    error = np.array([one.error for one in found])
    half = np.array([one.half for one in found], dtype=np.float64)
    within = [one.held for one in found]
    held = int(np.sum([abs(e) <= h if w is None else w for e, h, w in zip(error, half, within)]))
    z = Z90 * error / half
    return row | {
        "held": held / len(found),
        "wilson95": wilson(held, len(found)),
        "mean_z": float(np.mean(z)),
        "rms_z": float(np.sqrt(np.mean(z**2))),
        "rms_error": float(np.sqrt(np.mean(error**2))),
        "median_se": float(np.median(half)) / Z90,
    }


def of_runs(case: str, quantity: str, shares: Sequence[float]) -> dict[str, Any]:
    """The row of shares of runs' averages, which are not independent: runs are what is counted."""
    held = float(np.mean(shares))
    error = 1.96 * float(np.std(shares, ddof=1)) / np.sqrt(len(shares))
    return {
        "case": case,
        "quantity": quantity,
        "runs": len(shares),
        "stated": len(shares),
        "held": held,
        "wilson95": (held - float(error), min(held + float(error), 1.0)),
        "mean_z": None,
        "rms_z": None,
        "rms_error": None,
        "median_se": None,
    }


def share(case: str, quantity: str, part: int, whole: int, stated: float) -> dict[str, Any]:
    """The row of a verdict: how often it is wrong, against what is stated."""
    return {
        "case": case,
        "quantity": quantity,
        "runs": whole,
        "wrong": part / whole,
        "wilson95": wilson(part, whole),
        "stated": stated,
    }
