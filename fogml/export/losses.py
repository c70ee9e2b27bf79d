"""What a smaller form of a model loses on its training runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.export.plan import Plan
from fogml.export.points import box_points
from fogml.models.base import DriftModel
from fogml.models.folds import dealt_folds
from fogml.models.table import run_rows
from fogml.runs.run import Run
from fogml.signals import large
from fogml.signals.averages import block_averages


@dataclass(frozen=True)
class TrainingRows:
    """Rows of the training runs.

    Attributes
    ----------
    plan
        The plan whose atoms these are.
    atoms, target
        Atom values (n, a) and the error that a model describes (n,) [deg/h].
    time, run
        Time [s] and number of the run of each row, shape (n,).
    """

    plan: Plan
    atoms: FloatArray
    target: FloatArray
    time: FloatArray
    run: IndexArray

    def atoms_of(self, plan: Plan, rows: slice = slice(None)) -> FloatArray:
        """Atom values of a plan with some of these atoms."""
        return self.atoms[rows][:, [self.plan.atoms.index(atom) for atom in plan.atoms]]

    def left_by(self, plan: Plan) -> FloatArray:
        """What a plan with some of these atoms leaves of the target (n,) [deg/h]."""
        left = np.empty(len(self.target))
        for part in large.pieces(left):
            left[part] = self.target[part] - plan.value(plan.full_columns(self.atoms_of(plan, part)))
        return left


def runs_of_each(models: Sequence[DriftModel], runs: Sequence[Run]) -> list[list[Run]]:
    """The training runs of each model among some runs.

    Raises
    ------
    InputError
        If a run is none of the models' training runs: choices must not see other data.
    """
    known = [{run.sha256 for run in model.card_.runs} for model in models]
    for run in runs:
        if not any(run.hash in own for own in known):
            names = ", ".join(dict.fromkeys(run.name for model in models for run in model.card_.runs))
            raise InputError(
                f"{run.name}: is not one of the runs that the model was trained on ({names}); "
                "--train takes those alone, as they were"
            )
    return [[run for run in runs if run.hash in own] for own in known]


def training_rows(model: DriftModel, plan: Plan, runs: Sequence[Run]) -> TrainingRows:
    """The rows of a model's training runs.

    Raises
    ------
    InputError
        If a run is none of the model's training runs: choices must not see other data.
    """
    runs_of_each([model], runs)
    if model.features_ is None:
        raise InputError("--train: the model has no features, so there is nothing to choose")
    features = model.features_
    parts = [run_rows(run, features) for run in runs]
    return TrainingRows(
        plan,
        np.concatenate([part.atoms for part in parts]),
        np.concatenate([part.y for part in parts]),
        np.concatenate([part.time_s for part in parts]),
        np.repeat(np.arange(len(parts)), [len(part.y) for part in parts]),
    )


def accuracy_loss(
    whole: Plan, exported: Plan, rows: TrainingRows | None, averaging_s: float, seed: int
) -> dict[str, Any]:
    """Root mean squares of the model and of what is exported, rounding of arithmetic apart.

    With training rows: of what each leaves in averages over `averaging_s`, on five folds of
    blocks of time. Without: of the difference over the trained box.
    """
    if rows is None or whole.gives_rate:
        atoms = box_points(whole, seed)
        own = atoms[:, [whole.atoms.index(atom) for atom in exported.atoms]]
        gyro = np.zeros(len(atoms))
        off = exported.value(exported.full_columns(own), gyro) - whole.value(whole.full_columns(atoms), gyro)
        return {"on": "points in the trained box", "rms_difference": float(np.sqrt(np.mean(off**2)))}
    return averaged_loss(rows, [rows.left_by(plan) for plan in (whole, exported)], averaging_s)


def averaged_loss(rows: TrainingRows, left: Sequence[FloatArray], averaging_s: float) -> dict[str, Any]:
    """Root mean squares of averages of what a model and an export leave, in all and on five folds of them.

    Parameters
    ----------
    rows
        The training rows.
    left
        What the model leaves of their target, and what the export leaves [deg/h], each of shape (n,).
    averaging_s
        Averaging time [s].
    """
    squares: list[FloatArray] = []
    for number in np.unique(rows.run):
        mine = rows.run == number
        means = block_averages(rows.time[mine], *[part[mine] for part in left], window_s=averaging_s)
        squares.append(np.column_stack(means.values) ** 2)
    table = np.concatenate(squares)
    folds = dealt_folds(len(table))
    return {
        "on": "training folds",
        "averaging_s": averaging_s,
        "rms_model": float(np.sqrt(table[:, 0].mean())),
        "rms_exported": float(np.sqrt(table[:, 1].mean())),
        "folds": [
            {
                "rms_model": float(np.sqrt(table[folds == fold, 0].mean())),
                "rms_exported": float(np.sqrt(table[folds == fold, 1].mean())),
            }
            for fold in np.unique(folds)
        ],
    }
