"""Which form of a linear drift model to take: its error on held-out parts of the training runs.

A form is feature text, e.g. ``T1^1..2, dT1, T2^1..2, dT2``. Several training runs are left out in
turn; of a single one each of five parts of its time is. Test runs play no part.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fogml.errors import InputError
from fogml.features.atoms import temperatures_among
from fogml.features.parse import parse_features
from fogml.models.folds import run_folds, time_folds, told_by_each_other
from fogml.models.linear import LinearRegressor
from fogml.models.table import run_rows
from fogml.models.trial import averaged_rows, bare_table, held_out_prediction
from fogml.runs.run import Run


@dataclass(frozen=True)
class FormScore:
    """A form, its number of coefficients, and its rms error on held-out rows [deg/h]."""

    features: str
    coefficients: int
    held_out_rms: float


def multipoint_form(sensors: Sequence[str], order: int, rate_order: int) -> str:
    """Feature text of powers of each sensor and of each one's rate.

    Parameters
    ----------
    sensors
        Temperatures by name, at least one.
    order
        Highest power of each temperature, at least 1.
    rate_order
        Highest power of each rate; 0 leaves rates out.
    """
    whole = all(isinstance(one, int | np.integer) for one in (order, rate_order))
    if not sensors or not whole or order < 1 or rate_order < 0:
        raise InputError(
            "a multi-point form needs a sensor, a whole order of at least 1, a rate order of 0 up"
        )
    terms = []
    for sensor in sensors:
        terms.append(f"{sensor}^1..{order}" if order > 1 else sensor)
        if rate_order:
            terms.append(f"d{sensor}^1..{rate_order}" if rate_order > 1 else f"d{sensor}")
    return ", ".join(terms)


def sensor_sets(sensors: Sequence[str]) -> list[tuple[str, ...]]:
    """Every non-empty choice of sensors, small ones first."""
    return [chosen for size in range(1, len(sensors) + 1) for chosen in combinations(sensors, size)]


def score_form(features: str, runs: Run | Sequence[Run]) -> FormScore:
    """Error of a form, fitted by plain least squares, on held-out parts of the training runs.

    Raises
    ------
    InputError
        If the text is not understood, or a run lacks a sensor or is too short.
    """
    group = [runs] if isinstance(runs, Run) else list(runs)
    parsed = parse_features(features)
    rows = averaged_rows([run_rows(run, parsed) for run in group])
    atoms = np.concatenate([part.atoms for part in rows])
    table = bare_table(rows)
    told = told_by_each_other(table.run_index, atoms[:, temperatures_among(parsed.atoms)])
    folds = run_folds(table) if told else time_folds(table, blocks_per_fold=1)
    predicted = np.empty(len(table))
    for fitted, held in folds:
        prediction = held_out_prediction(LinearRegressor(), parsed, atoms, table, fitted, held)
        predicted[held] = prediction[0]
    rms = float(np.sqrt(np.mean((table.y - predicted) ** 2)))
    return FormScore(features, len(parsed) + 1, rms)


def rank_forms(forms: Iterable[str], runs: Run | Sequence[Run]) -> list[FormScore]:
    """Scores of the forms, the least error first; of equal errors the smaller form."""
    scores = [score_form(form, runs) for form in forms]
    return sorted(scores, key=lambda score: (score.held_out_rms, score.coefficients))


def smallest_within(scores: Sequence[FormScore], share: float = 0.02) -> FormScore:
    """The form with fewest coefficients whose error is within a share of the least one's."""
    if not scores:
        raise InputError("no form to choose from")
    least = min(score.held_out_rms for score in scores)
    near = [score for score in scores if score.held_out_rms <= (1.0 + share) * least]
    return min(near, key=lambda score: (score.coefficients, score.held_out_rms))
