"""Bias and scale factor repeatability over test runs of one unit and axis.

Bias repeatability is the standard deviation of the bias over power cycles, at least 6; scale
factor repeatability is ``std(K) / mean(K)``. A run counts as one power cycle; whether the unit was
switched off between them is known only where every run states its power-on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.validation.results import BeforeAfter, Repeatability, RunJudgement

LEAST_RUNS = 6


def repeatability_of(test: Sequence[RunJudgement]) -> Repeatability | None:
    """Repeatability over test runs; None for fewer than 6, or for several units or axes."""
    if len(test) < LEAST_RUNS or len({(run.unit, run.axis) for run in test}) > 1:
        return None
    bias = BeforeAfter(*(_spread([getattr(run, when).bias for run in test]) for when in ("before", "after")))
    errors = [[getattr(run, when).scale_factor_error for run in test] for when in ("before", "after")]
    told = all(value is not None for values in errors for value in values)
    scale = BeforeAfter(*(_relative_spread(values) for values in errors)) if told else None
    return Repeatability(len(test), all(run.power_on_known for run in test), bias, scale)


def _spread(values: Sequence[float]) -> float:
    return float(np.std(values, ddof=1))


def _relative_spread(errors_ppm: Sequence[float]) -> float:
    """``std(K) / mean(K)`` [ppm] of scale factors given as errors ``K - 1`` [ppm]."""
    return _spread(errors_ppm) / (1.0 + float(np.mean(errors_ppm)) / 1e6)
