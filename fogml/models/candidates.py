"""The candidates that the automatic choice weighs: which features, and whether a network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import product
from operator import add

from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.models.feature_model import shared_sensors
from fogml.runs.run import Run

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
