"""Choices judged on held-out parts of the training runs, fold after fold, on the same rows for all."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.features.terms import composition_plan
from fogml.models.card import checked_runs
from fogml.models.combination import left_out
from fogml.models.compact import Compact, network_of, operations_of_compact, operations_of_features
from fogml.models.feature_model import FeatureModel
from fogml.models.folds import Fold, run_folds, time_folds, told_by_each_other
from fogml.models.names import make_model
from fogml.models.regressors import parameter_count, weight_bytes
from fogml.models.table import RunRows, TrainingTable, longest_interval_s, usable_rows, without_refilling
from fogml.models.trial import averaged_rows, bare_table, held_out_prediction
from fogml.models.weighing import Weighed
from fogml.runs.run import Run
from fogml.tuning.plan import Choice, Space


def _held_out_predictions(
    made: Weighed, table: TrainingTable, atoms: FloatArray, folds: Sequence[Fold]
) -> Iterator[FloatArray]:
    """Drift on the rows that each fold holds out [deg/h], of the members fitted anew without these rows.

    `atoms` are the rows' values of the atoms of ``made.union``, shape (n, a). The members' weights and the
    sizes of a mixed-effects model are those that all training runs tell.
    """
    weights = np.array(list(made.weights.values()))
    both = _joined(made.table, replace(table, X=atoms))
    for _, held in folds:
        rest = np.flatnonzero(_apart(made.table, table, held))
        part = ("runs", (rest, len(made.table) + held))
        (found,) = left_out(made.members, made.union, both, [part])
        yield float(both.y[rest].mean()) + found.predicted @ weights


def _joined(first: TrainingTable, second: TrainingTable) -> TrainingTable:
    """The rows of two tables."""
    return replace(
        first,
        X=np.concatenate([first.X, second.X]),
        y=np.concatenate([first.y, second.y]),
        run_index=np.concatenate([first.run_index, second.run_index]),
        time_s=np.concatenate([first.time_s, second.time_s]),
        block=np.concatenate([first.block, second.block]),
    )


def _apart(averages: TrainingTable, table: TrainingTable, held: IndexArray) -> BoolArray:
    """Averages whose nearest row of the same run in the table is not held out."""
    apart = np.ones(len(averages), dtype=np.bool_)
    for run in np.unique(table.run_index[held]):
        rows, mine = (np.flatnonzero(one.run_index == run) for one in (averages, table))
        times = table.time_s[mine]
        after = np.searchsorted(0.5 * (times[1:] + times[:-1]), averages.time_s[rows])
        apart[rows] = ~np.isin(mine[after], held)
    return apart


FOLD_COUNTS = (2, 4, 5, 10, 20)
"""Numbers of folds that the 20 blocks of time of a run can be dealt to evenly."""
_BLOCKS = 20


@dataclass(frozen=True)
class FoldResult:
    """What one fold tells of a choice.

    Attributes
    ----------
    squared_errors
        Mean squared error on each block of time held out [(deg/h)**2].
    mean_errors
        Mean error on each block [deg/h], where a whole run is held out; else empty.
    rows
        Rows of each block.
    size_bytes
        Bytes of the fitted weights.
    operations
        Operations per sample.
    """

    squared_errors: list[float]
    rows: list[int]
    size_bytes: int
    operations: int
    mean_errors: list[float] = field(default_factory=list)


class HeldOut:
    """Training runs parted into folds, for any number of choices out of a space.

    Every choice is judged on the same rows: those at which the longest windows of the space are
    full, averaged over the same blocks of time.

    Parameters
    ----------
    runs
        Training runs.
    space
        What there is to choose from.
    references
        Choices from outside the space that are judged beside.
    folds
        ``runs`` leaves out a run at a time, ``time`` blocks of time; ``auto`` takes runs where there
        are several that tell each other.
    count
        Number of folds of time, one of `FOLD_COUNTS`.
    seed
        Seed of the networks.

    Raises
    ------
    InputError
        If the runs don't belong together, lack a temperature that the space names, or are too short.
    """

    def __init__(
        self,
        runs: Sequence[Run],
        space: Space,
        references: Iterable[Choice] = (),
        *,
        folds: Literal["auto", "time", "runs"] = "auto",
        count: int = 5,
        seed: int = 0,
    ) -> None:
        if count not in FOLD_COUNTS:
            raise InputError(f"{count} folds: one of {', '.join(map(str, FOLD_COUNTS))} was expected")
        self.runs = checked_runs(runs)
        self.seed = seed
        texts = [
            *space.extreme_texts(),
            *(one.made.union.text if one.made else one.features for one in references if one.features),
        ]
        self._used = [_rows_of_all(run, texts) for run in self.runs]
        by_run = folds == "runs" or (
            folds == "auto"
            and len(self.runs) > 1
            and told_by_each_other(self._table.run_index, self._atoms("T"))
        )
        self.folds: list[Fold] = (
            run_folds(self._table)
            if by_run
            else time_folds(self._table, count, blocks_per_fold=_BLOCKS // count)
        )
        self.by_run = by_run

    @property
    def averaging_s(self) -> float:
        """Time that a row held out is averaged over [s]."""
        return self._table.averaging_s

    @cached_property
    def _table(self) -> TrainingTable:
        """The rows without features."""
        rows = [
            RunRows(np.empty((int(used.sum()), 0)), run.error_deg_h[used], run.time[used])
            for run, used in zip(self.runs, self._used, strict=True)
        ]
        averaged = averaged_rows(rows)
        table = replace(bare_table(averaged), averaging_s=longest_interval_s(averaged))
        if len(table) < 2 * _BLOCKS:
            raise InputError(
                f"the training runs hold {len(table)} rows with full windows; give longer runs, or shorter "
                "windows in the space"
            )
        return table

    def judged(self, choice: Choice) -> Iterator[FoldResult]:
        """The choice on each fold in turn.

        Raises
        ------
        InputError
            If it can't be fitted to these runs.
        """
        for (_, held), (predicted, bytes_, operations) in zip(
            self.folds, self._predictions(choice), strict=True
        ):
            errors = self._table.y[held] - predicted
            starts = np.flatnonzero(np.diff(self._table.block[held], prepend=-1))
            counts = np.diff(starts, append=len(held))
            squares, means = (np.add.reduceat(x, starts) / counts for x in (errors**2, errors))
            apart = means.tolist() if self.by_run else []
            yield FoldResult(squares.tolist(), counts.tolist(), bytes_, operations, apart)

    def _predictions(self, choice: Choice) -> Iterator[tuple[FloatArray, int, int]]:
        if not choice.features:
            for fitted, held in self.folds:
                yield np.full(len(held), self._table.y[fitted].mean()), 8, 1
            return
        if choice.made is not None:
            made, atoms = choice.made, self._atoms(choice.made.union.text)
            assert isinstance(made.model, FeatureModel)
            regressor = made.model.regressor_
            cost = weight_bytes(regressor), self._operations(made.model.features_, regressor)
            for predicted in _held_out_predictions(made, self._table, atoms, self.folds):
                yield predicted, *cost
            return
        features = parse_features(choice.features)
        atoms = self._atoms(features.text)
        model = make_model(choice.model, choice.features, self.seed, choice.parameters)
        assert isinstance(model, FeatureModel)
        for fitted, held in self.folds:
            regressor = model.unfitted_regressor(len(features))
            predicted, _, regressor = held_out_prediction(
                regressor, features, atoms, self._table, fitted, held
            )
            if not np.isfinite(predicted).all():
                raise InputError(f"{choice.model} of {choice.features}: values that are not finite")
            yield predicted, weight_bytes(regressor), self._operations(features, regressor)

    def _operations(self, features: Features, regressor: Any) -> int:
        """Operations per sample, as exported code takes them.

        Where a regressor has no compact form, each of its numbers is taken to be used in a multiplication
        and an addition, which holds for kernel and network models.
        """
        steps = composition_plan(features.terms, features.atoms)
        count = operations_of_features(features.atoms, steps, self.runs[0].sample_s)
        network = network_of(regressor)
        if network is None:
            return count + 2 * (parameter_count(regressor) - 1)
        return count + operations_of_compact(Compact("", network))

    def _atoms(self, text: str) -> FloatArray:
        features = parse_features(text)
        rows = []
        for run, used in zip(self.runs, self._used, strict=True):
            atoms = features.atom_values(run).values
            rows.append(RunRows(atoms[used], run.error_deg_h[used], run.time[used]))
        return np.concatenate([part.atoms for part in averaged_rows(rows)])


def _rows_of_all(run: Run, texts: Sequence[str]) -> BoolArray:
    """Rows of a run at which every window of feature texts is full."""
    full = np.ones(len(run), dtype=np.bool_)
    for text in texts:
        features = parse_features(text)
        full &= without_refilling(run, features, features.atom_values(run).full)[0]
    return usable_rows(run, full)[0]
