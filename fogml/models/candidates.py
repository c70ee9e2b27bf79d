"""The candidates that the automatic choice weighs (features, with a network or not), and their scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import product
from operator import add

import numpy as np

from fogml.arrays import FloatArray, IndexArray
from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.models.feature_model import shared_sensors
from fogml.runs.run import Run
from fogml.signals.distributions import chi2_ppf

_AT_LEAST_CUBIC = ("T^1..3", "T^1..5")
_STATIC = ("", "T", "T^1..2", *_AT_LEAST_CUBIC)
_RATE_TERMS = "dT, T*dT"
_RATE = ("", "dT", _RATE_TERMS)
_GRADIENT = ("T_in-T_out", "T_in-T_out, d(T_in-T_out)")
_DIRECTION = ("", "sign(dT)")
_EACH_SENSOR_AND_RATE = ("{0}, d{0}", "{0}^1..2, d{0}")
_EACH_SENSOR = ("{0}", *_EACH_SENSOR_AND_RATE)
# More coil sensors than inner and outer face: each of them may tell something of its own.
_MANY_SENSORS = 3


@dataclass(frozen=True)
class Candidate:
    """One way to describe the drift.

    Attributes
    ----------
    features
        Feature text; empty for the training runs' mean.
    network
        Whether an RBF network maps the features, rather than a linear model.
    """

    features: str
    network: bool = False

    @property
    def name(self) -> str:
        """What reports call it."""
        if not self.features:
            return "mean"
        return f"RBF network of {self.features}" if self.network else self.features


STANDARD = Candidate("T^1..3, dT, T*dT")
"""The form that other candidates are measured against: cubic in T with the rate and T times the rate."""


def candidates_of(features: str) -> list[Candidate]:
    """Candidates where the features are given: linear first, a network, and the mean."""
    return [Candidate(features), Candidate(features, network=True), Candidate("")]


STATIC_STANDARD = Candidate("T^1..3")
"""The same where the direction of temperature is not told."""


def candidates_for(runs: Sequence[Run], rates_told: bool, direction_told: bool) -> list[Candidate]:
    """Candidates for training runs, the standard form first.

    Parameters
    ----------
    runs
        Training runs; the sensors that all of them hold decide what there is to choose from.
    rates_told
        Whether the training runs hold three or more distinct rates of temperature. With fewer,
        nothing tells a rate from its direction, from its powers or from the rate of a gradient,
        nor whether a term in it may be left out, and what was fitted fails at the next rate: only
        what holds the standard form's terms in the rate, and is linear in it, is offered, and
        nothing smaller; no network is.
    direction_told
        Whether what the direction of temperature does is told. On one way only, rate and gradient are
        functions of temperature and time, and what was fitted to them turns against the model on the way
        back; of a run up and a run down they are functions of the run too: only terms in the temperatures
        are offered.
    """
    if not direction_told:
        linear = [STATIC_STANDARD, *(Candidate(text) for text in _STATIC if text != STATIC_STANDARD.features)]
        return linear
    sensors = shared_sensors(runs)
    faces = len(sensors) > 1
    gradient = ("", *(_GRADIENT if rates_told else _GRADIENT[:1])) if faces else ("",)
    families = (
        [_STATIC, _RATE, gradient, _DIRECTION] if rates_told else [_AT_LEAST_CUBIC, (_RATE_TERMS,), gradient]
    )
    texts = {", ".join(part for part in parts if part) for parts in product(*families)}
    if len(sensors) >= _MANY_SENSORS:
        forms = _EACH_SENSOR if rates_told else _EACH_SENSOR_AND_RATE
        texts |= {", ".join(form.format(name) for name in sensors) for form in forms}
    linear = [STANDARD, *(Candidate(text) for text in sorted(texts - {STANDARD.features}))]
    networks = [", ".join(part for part in ("T", _RATE_TERMS, extra) if part) for extra in gradient]
    mapped = [Candidate(text, network=True) for text in ("T", *networks)] if rates_told else []
    return [*linear, *mapped, *([] if rates_told else [Candidate("")])]


def union_of(candidates: Sequence[Candidate]) -> Features:
    """Features that hold every atom of the candidates; they have at least one."""
    texts = [candidate.features for candidate in candidates if candidate.features]
    return reduce(add, (parse_features(text) for text in texts))


STANDARD_ERRORS = 2.0
"""A gain of this many standard errors is beyond noise. At one, of dozens of candidates some pass by luck."""
MATERIAL = 20.0
"""How many times what noise costs a fit a gain must be before a larger form is surely the better one.

Noise leaves p * s**2 / n in a fit of p parameters to n rows. Where a form gains little more than
that, whether it does better on the next run is decided by the noise of this one, all the more at
another ramp rate, where errors of the terms in the rate are several times as large. With the
cubic in T, dT and T*dT, forms that did harm gained up to 11 times that on 150 synthetic units.
"""


@dataclass(frozen=True)
class Score:
    """A candidate on what the folds held out.

    Attributes
    ----------
    candidate
        What was scored.
    parameters
        Its number of parameters.
    squared_errors
        Mean squared error on each block of time [(deg/h)**2], shape (b,). Of several training
        runs each block is there twice: with its run left out, then with its part of the time.
    rows
        Rows of each block, shape (b,).
    of_runs
        How many of the blocks, from the first, come from runs left out; None: the score does not
        part them.
    """

    candidate: Candidate
    parameters: int
    squared_errors: FloatArray
    rows: IndexArray
    of_runs: int | None = None

    @property
    def mean_square(self) -> float:
        """Mean squared error over all rows [(deg/h)**2]."""
        return float(np.average(self.squared_errors, weights=self.rows))

    @property
    def on_runs(self) -> Score:
        """The score on runs left out alone, where there are several; else the score itself."""
        if self.of_runs is None:
            return self
        held = slice(self.of_runs)
        return replace(self, squared_errors=self.squared_errors[held], rows=self.rows[held], of_runs=None)

    @property
    def trained_rows(self) -> int:
        """Training rows n; of several runs each row is held out twice, and counts once."""
        return int(self.rows[self.of_runs :].sum())

    def outweighs_noise(self, other: Score) -> bool:
        """Whether its gain is `MATERIAL` times what noise costs the other's fit, p * s**2 / n.

        The noise s**2 is what this one leaves, so the smaller of what the two leave.
        """
        gain = other.mean_square - self.mean_square
        return gain > MATERIAL * other.parameters * self.mean_square / self.trained_rows

    @property
    def leaves_even_noise(self) -> bool:
        """Whether its errors are as large in all blocks as white noise of one size would be.

        The mean squares of m rows of white noise scatter by 2 s**4 / m; their sum of squares in these
        units is a chi-square of b - 1 degrees of freedom, exceeded by chance once in a thousand.
        """
        if not self.mean_square > 0.0:
            return True
        scatter = np.sum(self.rows * (self.squared_errors / self.mean_square - 1.0) ** 2) / 2.0
        return bool(scatter < chi2_ppf(0.999, len(self.rows) - 1))

    def beats(self, other: Score, standard_errors: float = STANDARD_ERRORS) -> bool:
        """Whether it is better by more than so many standard errors of the difference, block by block."""
        weights = self.rows / self.rows.sum()
        gain = other.squared_errors - self.squared_errors
        mean = float(weights @ gain)
        count = len(weights)
        error = float(np.sqrt(np.sum((weights * (gain - mean)) ** 2) * count / max(count - 1, 1)))
        return mean > standard_errors * error

    def as_dict(self) -> dict[str, float | int | str]:
        """Name, parameters and rms error on the held-out rows [deg/h]."""
        return {
            "name": self.candidate.name,
            "parameters": self.parameters,
            "held_out_rms": float(np.sqrt(self.mean_square)),
        }


def choose(scores: Sequence[Score], *, rates_told: bool, both_directions: bool = True) -> Score:
    """The candidate to take.

    The first score is the standard form's. A larger candidate replaces it only if it beats it; of
    those the best is taken. Else a smaller one replaces it if it is no worse; the smallest of
    those is taken. What does not beat the training runs' mean is not worth its parameters: then
    the mean is taken. That last question is put to runs left out, where there are several: parts
    of a run are predicted well from the rest of it whatever it is that moved the drift, time
    included, and harm shows on the next run only. Of one run up and down, a gain that comes from a
    few blocks may be within two standard errors however sure it is; where what is left is even
    noise, it is worth its parameters too if it outweighs the noise.

    Parameters
    ----------
    scores
        All candidates', the standard form's first, the mean's among them.
    rates_told
        Whether the training runs hold three or more distinct rates of temperature. With fewer,
        what is held out lies at the rates fitted to and can't show what goes wrong at another, so
        the gain of a larger candidate must outweigh the noise too.
    both_directions
        Whether temperature both rises and falls. On one way only, drift in time looks like drift
        with temperature, and noise is no measure of what is sure.
    """
    mean = next(score for score in scores if not score.candidate.features)
    standard = scores[0]
    larger = [s for s in scores if s.parameters > standard.parameters and s.beats(standard)]
    if not rates_told:
        larger = [s for s in larger if s.outweighs_noise(standard)]
    if larger:
        choice = min(larger, key=lambda s: s.mean_square)
    else:
        small = [s for s in scores if s.parameters <= standard.parameters]
        no_worse = [s for s in small if s.mean_square <= standard.mean_square]
        choice = min(no_worse, key=lambda s: (s.parameters, s.mean_square))
    if choice.on_runs.beats(mean.on_runs):
        return choice
    one_run = choice.of_runs is None
    sure = one_run and both_directions and choice.leaves_even_noise and choice.outweighs_noise(mean)
    return choice if sure else mean
