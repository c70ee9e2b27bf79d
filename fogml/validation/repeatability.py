"""Bias and scale factor repeatability over test runs of one unit and axis.

Bias repeatability is the standard deviation of the bias over power cycles, at least 6; scale
factor repeatability is ``std(K) / mean(K)``. Runs that state their power-on are power cycles; where fewer
than 6 do, every run counts, and whether the unit was switched off between them is not known.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.validation.results import BeforeAfter, Repeatability, RunJudgement

LEAST_RUNS = 6


def repeatability_of(test: Sequence[RunJudgement]) -> Repeatability | None:
    """Repeatability over test runs; None for fewer than 6, or for several units or axes.

    That of the scale factor is over those of them that hold turns, where 6 do.
    """
    cycles = [run for run in test if run.power_on_known]
    over = cycles if len(cycles) >= LEAST_RUNS else test
    if len(over) < LEAST_RUNS or len({(run.unit, run.axis) for run in over}) > 1:
        return None
    bias = BeforeAfter(*(_spread([getattr(run, when).bias for run in over]) for when in ("before", "after")))
    turned = [run for run in over if run.after.scale_factor_error is not None]
    scale = None
    if len(turned) >= LEAST_RUNS:
        errors = ([getattr(run, when).scale_factor_error for run in turned] for when in ("before", "after"))
        scale = BeforeAfter(*map(_relative_spread, errors))
    return Repeatability(len(over), over is cycles, bias, scale)


def _spread(values: Sequence[float]) -> float:
    return float(np.std(values, ddof=1))


def _relative_spread(errors_ppm: Sequence[float]) -> float:
    """``std(K) / mean(K)`` [ppm] of scale factors given as errors ``K - 1`` [ppm]."""
    return _spread(errors_ppm) / (1.0 + float(np.mean(errors_ppm)) / 1e6)
