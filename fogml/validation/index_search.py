"""Training again until the design index is met, without ever looking at the test run.

The method of the temperature product (Sensors 2015, 15(5), 11189) trains again whenever the
validation run misses the design index, which makes the validation run part of the training.
Here sizes and features are tried on folds of the training runs, from small to large, until the
index is met there; the test run is judged once, by what was found.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import FogmlError, InputError, counted
from fogml.models.table import usable_rows
from fogml.numerals import against, stated
from fogml.runs.exchange import runs_of
from fogml.runs.run import Run
from fogml.runs.transitions import transition_mask
from fogml.signals.averages import AVERAGING_S, block_averages
from fogml.validation.floors import floor_of_run, out_of_reach
from fogml.validation.limits import check_design_index

if TYPE_CHECKING:
    from fogml.models.base import DriftModel

FEATURE_LADDER = ("T", "T^1..3", "T, dT, T*dT", "T^1..3, dT, T*dT", "T^1..5, dT, T*dT")
"""Features tried with a polynomial, from small to large."""
NETWORK_FEATURES = ("T", "T, dT", "T, dT, T*dT")
"""Features tried with a network."""
SIZES = (4, 8, 16, 32, 64)
"""Numbers of centres tried with a network."""
PARTS = 5
"""Parts of time that a single training run is cut into."""


@dataclass(frozen=True)
class Candidate:
    """One thing to try: a model by name, its features, the centres of a network, and other parameters."""

    model: str
    features: str | None
    centres: int | None = None
    parameters: Mapping[str, Any] | None = None

    @property
    def name(self) -> str:
        """What messages call it."""
        parts = [self.model, f"of {self.features}" if self.features else ""]
        parts.append(f"with {self.centres} centres" if self.centres else "")
        return " ".join(part for part in parts if part)

    def make(self, seed: int) -> DriftModel:
        """The unfitted model."""
        from fogml.models.names import make_model

        model = make_model(self.model, self.features, seed, self.parameters)
        return model if self.centres is None else model.set_params(regressor__centres=self.centres)


@dataclass(frozen=True)
class Trial:
    """A candidate and the rms of its averages on what the folds held out [deg/h]; None: not fitted."""

    candidate: Candidate
    rms: float | None
    reason: str | None = None


@dataclass(frozen=True)
class IndexSearch:
    """What the search found.

    Attributes
    ----------
    model
        The candidate found, fitted to all training runs.
    chosen
        Its trial; None where nothing was tried.
    trials
        Every trial, in order.
    design_index
        The index asked for [deg/h].
    out_of_reach
        Why no model can meet the index, in which case nothing was tried.
    """

    model: DriftModel
    chosen: Trial | None
    trials: tuple[Trial, ...]
    design_index: float
    out_of_reach: str | None = None

    @property
    def met(self) -> bool:
        """Whether the index was met on the folds of the training runs."""
        rms = None if self.chosen is None else self.chosen.rms
        return rms is not None and rms <= self.design_index

    def summary(self) -> str:
        """The search in a sentence: how many tries, and what was taken."""
        if self.chosen is None:
            return f"{self.out_of_reach}. Nothing was searched; the model is fitted as without a search."
        outcome = (
            f"{self.chosen.candidate.name} is the first to meet the design index there"
            if self.met
            else f"none meets the design index there, {self.chosen.candidate.name} comes nearest"
        )
        tries = counted(len(self.trials), "try", "tries")
        return (
            f"Searched on folds of the training runs in {tries}: {outcome} "
            f"({against(self.chosen.rms, self.design_index)} deg/h against "
            f"{stated(self.design_index)}). The test runs were judged once."
        )


def train_until_index(
    runs: Run | Sequence[Run],
    design_index: float,
    *,
    model: str = "auto",
    features: str | None = None,
    averaging_s: float = AVERAGING_S,
    seed: int = 0,
    parameters: Mapping[str, Any] | None = None,
    step: Callable[[str], None] | None = None,
) -> IndexSearch:
    """Try sizes and features until the design index is met on folds of the training runs.

    Each training run in turn is held out where there are several, else each of five parts of the
    one run's time. An index below what the noise of the training runs leaves is out of reach of any model:
    then nothing is tried, and `model` is fitted as it is.

    Parameters
    ----------
    runs
        Training runs.
    design_index
        Greatest rms of averages allowed on what was held out [deg/h].
    model
        ``auto`` tries polynomials, then networks; ``polynomial`` and ``rbf`` try their own; any
        other name is the only one tried.
    features
        Feature text; by default several are tried.
    averaging_s
        Averaging time [s].
    seed
        Seed of the networks.
    parameters
        Of the regressor, as `fogml.models.names.make_model` takes them; stated centres alone are tried.
    step
        Called with what is tried next.

    Raises
    ------
    InputError
        If no candidate can be fitted, the parameters are none of the model's, or the index is not positive.
    """
    check_design_index(design_index)
    group = runs_of(runs)
    asked = Candidate(model, features, parameters=parameters)
    if parameters:
        asked.make(seed)  # which refuses what does not go together
    beyond = _out_of_reach(group, design_index, averaging_s)
    if beyond is not None:
        if step is not None:
            step(f"fitting {model}, as the design index is out of reach")
        return IndexSearch(asked.make(seed).fit(group), None, (), design_index, beyond)
    trials: list[Trial] = []
    for candidate in candidates(model, features, parameters):
        if step is not None:
            step(f"try {len(trials) + 1}: {candidate.name}")
        trials.append(_try(candidate, group, averaging_s, seed))
        rms = trials[-1].rms
        if rms is not None and rms <= design_index:
            break
    fitted = [trial for trial in trials if trial.rms is not None]
    if not fitted:
        raise InputError(
            f"no candidate can be fitted to these runs; {trials[0].candidate.name}: {trials[0].reason}"
        )
    chosen = min(fitted, key=lambda trial: trial.rms if trial.rms is not None else np.inf)
    if step is not None:
        step(f"fitting {chosen.candidate.name} to all training runs")
    return IndexSearch(chosen.candidate.make(seed).fit(group), chosen, tuple(trials), design_index)


def _out_of_reach(runs: Sequence[Run], design_index: float, averaging_s: float) -> str | None:
    floors, averages = [], []
    for run in runs:
        used, _ = usable_rows(run, np.ones(len(run), dtype=np.bool_))
        averages.append(len(block_averages(run.time[used], window_s=averaging_s)))
        floors.append(floor_of_run(run, used, run.error_deg_h, averaging_s))
    return out_of_reach(design_index, floors, averages, averaging_s, "the training runs")


def candidates(
    model: str, features: str | None, parameters: Mapping[str, Any] | None = None
) -> list[Candidate]:
    """What is tried for a model's name, from small to large."""
    polynomials = [
        Candidate("polynomial", text, parameters=parameters)
        for text in ([features] if features else FEATURE_LADDER)
    ]
    networks = [
        Candidate("rbf", text, size, parameters)
        for size in ([None] if parameters and "centres" in parameters else SIZES)
        for text in ([features] if features else NETWORK_FEATURES)
    ]
    families = {"auto": [*polynomials, *networks], "polynomial": polynomials, "rbf": networks}
    return families.get(model, [Candidate(model, features, parameters=parameters)])


def _try(candidate: Candidate, runs: Sequence[Run], averaging_s: float, seed: int) -> Trial:
    squares = []
    try:
        for fitted, held_run, held in _folds(runs):
            squares.append(_held_out(candidate.make(seed).fit(fitted), held_run, held, averaging_s) ** 2)
    except (FogmlError, ValueError, ArithmeticError) as error:
        return Trial(candidate, None, str(error))
    values = np.concatenate(squares)
    if len(values) == 0:
        return Trial(candidate, None, f"no average over {averaging_s:g} s is held out; choose a shorter one")
    return Trial(candidate, float(np.sqrt(values.mean())))


def _folds(runs: Sequence[Run]) -> list[tuple[list[Run], Run, BoolArray]]:
    """Runs to fit to, the run judged, and its rows that were held out."""
    if len(runs) > 1:
        return [
            ([*runs[:i], *runs[i + 1 :]], run, np.ones(len(run), dtype=bool)) for i, run in enumerate(runs)
        ]
    (run,) = runs
    edges = np.linspace(0, len(run), PARTS + 1).astype(int)
    if "rate" in run.columns:
        # A part that began amid a change of the table's rate would not know that its first rows are of one.
        calm = np.append(np.flatnonzero(~transition_mask(run)), len(run))
        edges[1:-1] = calm[np.searchsorted(calm, edges[1:-1])]
    folds = []
    for start, stop in pairwise(edges.tolist()):
        held = np.zeros(len(run), dtype=bool)
        held[start:stop] = True
        folds.append(([part for part in (run[:start], run[stop:]) if len(part)], run, held))
    return folds


def _held_out(model: DriftModel, run: Run, held: BoolArray, averaging_s: float) -> FloatArray:
    """Averages of the error after compensation over held-out rows [deg/h]."""
    evaluation = model.evaluate(run)
    used = usable_rows(run, evaluation.full)[0] & held
    error = (run.error_deg_h - evaluation.drift)[used]
    return block_averages(run.time[used], error, window_s=averaging_s).values[0]
