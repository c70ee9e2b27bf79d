"""Scoring candidates on parts of the training runs held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.features.atoms import temperatures_among
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.models.base import DriftModel
from fogml.models.box import direction_is_told, each_moves_both_ways, learn_box, moves_both_ways
from fogml.models.candidates import Candidate, Score, candidates_for, candidates_of, choose, union_of
from fogml.models.folds import Fold, dealt_blocks, run_folds, time_folds, told_by_each_other
from fogml.models.linear import LinearRegressor
from fogml.models.rbf.rates import RATES_THAT_TELL, distinct_rates
from fogml.models.regressors import (
    fit_regressor,
    for_features,
    goes_on_linearly,
    parameter_count,
    predict_rows,
)
from fogml.models.table import RunRows, TrainingTable, averaging_of, recorded_s, row_count, run_rows
from fogml.models.weights import shift_share
from fogml.runs.run import Run
from fogml.settings_check import GREATEST_SEED, check_whole
from fogml.signals.averages import block_averages

SCORED_ROWS = 2500
"""Training rows are averaged over blocks of time down to this number for scoring."""
TRIED_CENTRES, TRIED_ROWS = 16, 1000
FOLDS, BLOCKS_PER_FOLD = 10, 2
_MOTION = parse_features("T, dT")


class Trial:
    """The training runs, averaged and parted into folds, for any number of candidates.

    Parameters
    ----------
    runs
        Training runs.
    seed
        Seed of the networks.
    features
        Features to keep to; None leaves them open too.

    Attributes
    ----------
    candidates
        What there is to choose from, the standard form first.
    rates
        Number of distinct rates of temperature in the training runs.
    several_runs
        Whether there are several runs that tell each other, each of which is left out in turn.
    both_directions
        Whether temperature moves both ways in the training runs (`fogml.models.box`).
    direction_told
        Whether what its direction does is told beside what shifts a run; else simple forms hold no rates.
    """

    def __init__(self, runs: Sequence[Run], seed: int, features: str | None = None) -> None:
        check_whole("seed", seed, 0, GREATEST_SEED)
        self.seed = seed
        temperature, rate = _temperatures_and_rates(runs)
        self.rates = distinct_rates(rate, temperature)
        temperatures = [run.temperature("T") for run in runs]
        self.both_directions = moves_both_ways(temperatures)
        self.direction_told = direction_is_told(temperatures)
        self._courses_tell = each_moves_both_ways(temperatures)
        self._known: dict[tuple[Candidate, int], tuple[FloatArray, int]] = {}
        self.candidates = (
            candidates_of(features)
            if features
            else candidates_for(runs, self.rates_told, self.direction_told)
        )
        union = union_of(self.candidates)
        self._column = {atom.text: column for column, atom in enumerate(union.atoms)}
        rows = [run_rows(run, union) for run in runs]
        row_count(rows)
        averaged = averaged_rows(rows)
        self._atoms = np.concatenate([part.atoms for part in averaged])
        self._table = bare_table(averaged)
        # A run shorter than the windows leaves no row.
        values = self._atoms[:, temperatures_among(union.atoms)]
        self.several_runs = told_by_each_other(self._table.run_index, values)
        self._partings: list[list[Fold]] = [time_folds(self._table, FOLDS, blocks_per_fold=BLOCKS_PER_FOLD)]
        if self.several_runs:
            self._partings.insert(0, run_folds(self._table))

    @property
    def rates_told(self) -> bool:
        """Whether there are rates of temperature enough to tell terms in the rate from others."""
        return self.rates >= RATES_THAT_TELL

    @property
    def one_rate(self) -> bool:
        """Whether terms in the rate are offered that too few rates tell."""
        return self.direction_told and not self.rates_told

    def score(self, candidate: Candidate) -> Score:
        """Errors of a candidate on the rows that each fold holds out.

        Of several runs, each is left out in turn, and each of ten parts of the time of all of them
        too. Runs left out tell what the next run holds that these did not, but each fit lacks a
        rate or a direction that the model will have seen; parts of the time are judged by fits
        that lack next to nothing. Both count alike.
        """
        table = self._table
        squares, rows = [], []
        for parting in range(len(self._partings)):
            predicted, parameters = self._predicted(candidate, parting)
            by_block = squares_by_block(table, self._apart(table.y - predicted))
            squares.append(by_block[0])
            rows.append(by_block[1])
        of_runs = len(rows[0]) if self.several_runs else None
        return Score(candidate, parameters, np.concatenate(squares), np.concatenate(rows), of_runs)

    def _predicted(self, candidate: Candidate, parting: int) -> tuple[FloatArray, int]:
        """What a candidate foretells of each row while its fold is held out, and its number of parameters."""
        if (candidate, parting) in self._known:
            return self._known[candidate, parting]
        predicted, parameters = np.empty(len(self._table)), 1
        for fitted, held in self._partings[parting]:
            if not candidate.features:
                predicted[held] = self._table.y[fitted].mean()
                continue
            features = parse_features(candidate.features)
            atoms = self._atoms[:, [self._column[atom.text] for atom in features.atoms]]
            predicted[held], parameters = held_out_prediction(
                regressor_for(candidate, self.seed), features, atoms, self._table, fitted, held
            )[:2]
        self._known[candidate, parting] = predicted, parameters
        return predicted, parameters

    def _apart(self, errors: FloatArray) -> FloatArray:
        """Errors with the mean of each run as far as it counts."""
        index = self._table.run_index
        means = np.bincount(index, errors) / np.maximum(np.bincount(index), 1)
        return errors - (1.0 - self._shift_share) * means[index]

    @cached_property
    def _shift_share(self) -> float:
        """How far the mean of a run counts beside its course, by what the standard form leaves of it."""
        if not (self.several_runs and self._courses_tell):
            return 1.0
        folds, told = self._partings[0], self._table.y
        left = told - self._predicted(self.candidates[0], 0)[0]
        return shift_share([left[held] for _, held in folds], [told[held] for _, held in folds])

    def chosen(self, scores: Sequence[Score]) -> Score:
        """The score of the candidate that these runs speak for."""
        return choose(scores, rates_told=self.rates_told, both_directions=self.both_directions)


def held_out_prediction(
    regressor: Any,
    features: Features,
    atoms: FloatArray,
    table: TrainingTable,
    fitted: IndexArray,
    held: IndexArray,
) -> tuple[FloatArray, int, Any]:
    """A regressor fitted to some rows and evaluated on others, which are limited to the box of the first.

    Parameters
    ----------
    regressor
        Unfitted.
    features
        What its columns are.
    atoms
        Values of the features' atoms, shape (n, a).
    table
        The n rows, without features.
    fitted, held
        Indices of the rows fitted to, and of those held out.

    Returns
    -------
    (values at the rows held out [deg/h], number of parameters, the fitted regressor)
    """
    learn_box(features, [atoms[fitted]])
    rows = replace(table.take(fitted), X=features.compose(atoms[fitted]))
    regressor = fit_regressor(for_features(regressor, features, [atoms[fitted]]), rows)
    full = np.ones(len(held), dtype=np.bool_)
    limited, _ = features.limit(atoms[held], full, linear=goes_on_linearly(regressor))
    return predict_rows(regressor, features.compose(limited)), parameter_count(regressor), regressor


def squares_by_block(table: TrainingTable, errors: FloatArray) -> tuple[FloatArray, IndexArray]:
    """Mean squared error [(deg/h)**2] and number of rows of each of a table's b blocks, shapes (b,)."""
    squares = errors**2
    starts = np.flatnonzero(np.diff(table.block, prepend=-1))
    counts = np.diff(starts, append=len(table))
    return np.add.reduceat(squares, starts) / counts, counts


def regressor_for(candidate: Candidate, seed: int) -> Any:
    """The bare regressor that stands for a candidate on the folds.

    A network is tried small and with shared widths only: a tenth of the time, and never better
    than the network that is fitted in the end.
    """
    if candidate.network:
        from fogml.models.rbf import RBFRegressor

        return RBFRegressor(TRIED_CENTRES, tune=False, average_rows=TRIED_ROWS, seed=seed)
    return LinearRegressor()


def fit_candidate(candidate: Candidate, runs: Sequence[Run], seed: int) -> DriftModel:
    """The candidate as a drift model, fitted to all training runs."""
    from fogml.models.names import make_model

    if not candidate.features:
        return make_model("mean").fit(runs)
    name = "rbf" if candidate.network else "polynomial"
    return make_model(name, features=candidate.features, seed=seed).fit(runs)


def _temperatures_and_rates(runs: Sequence[Run]) -> tuple[FloatArray, FloatArray]:
    """Temperature [degC] and its rate [degC/min] over all rows with full windows."""
    rows = [values[full] for values, full, _ in (_MOTION.atom_values(run) for run in runs)]
    temperature, rate = np.concatenate(rows).T
    return temperature, rate


def averaged_rows(rows: Sequence[RunRows]) -> list[RunRows]:
    """Rows averaged over time down to `SCORED_ROWS` in all; as they are where there are fewer."""
    if sum(len(part.y) for part in rows) <= SCORED_ROWS:
        return list(rows)
    window_s = averaging_of(rows, recorded_s(rows) / SCORED_ROWS)
    averaged = []
    for part in rows:
        means = block_averages(part.time_s, part.atoms, part.y, window_s=window_s)
        averaged.append(RunRows(means.values[0], means.values[1], means.time_s))
    return averaged


def bare_table(rows: Sequence[RunRows]) -> TrainingTable:
    """A table without features: those are composed for each candidate."""
    blocks = [dealt_blocks(len(part.y)) for part in rows]
    first = np.cumsum([0, *(int(block[-1]) + 1 if len(block) else 0 for block in blocks)])
    y = np.concatenate([part.y for part in rows])
    return TrainingTable(
        X=np.empty((len(y), 0)),
        y=y,
        run_index=np.repeat(np.arange(len(rows)), [len(part.y) for part in rows]),
        time_s=np.concatenate([part.time_s for part in rows]),
        block=np.concatenate([block + start for block, start in zip(blocks, first)]),
    )
