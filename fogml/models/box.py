"""What training rows span, and whether runs can tell what features ask for.

Their box, distances from it, how temperature moves in them; memories within the runs, banks within the
recorded range.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.features.atoms import Atom
from fogml.features.box import Box
from fogml.features.features import Features
from fogml.features.operators import most_beyond
from fogml.features.signal import TIME_ON
from fogml.features.slices import SavedSlices
from fogml.numerals import short
from fogml.runs.run import Run


def learn_box(features: Features, atoms: Iterable[FloatArray]) -> None:
    """Set the features' box around values of their atoms in the training rows, each of shape (n, a).

    What lies beyond bounds is 0 in training rows and levels off by itself: its box is all that it can be.

    Raises
    ------
    InputError
        If a feature is larger than `LARGEST` there.
    """
    features.learn([(values, np.ones(len(values), dtype=np.bool_)) for values in atoms])
    spans = dict(features.box)
    for atom in features.atoms:
        if atom.bounds is not None:
            most = most_beyond(*atom.bounds)
            spans[atom.text] = (-most, most)
    features.set_box(spans, slices_of(features))
    digits = {text: np.log10(max(abs(low), abs(high), 1e-300)) for text, (low, high) in spans.items()}
    for term in features.terms:
        size = sum(power * digits[atom.text] for atom, power in term.factors)
        if size > np.log10(LARGEST):
            raise InputError(
                f"feature {term.text} is as large as 1e{size:.0f} in the training runs, {LARGEST:g} at most "
                "can be fitted to; take a lower power, or a share of the column, as 1e-6*power"
            )


LARGEST = 1e150
"""Largest value of a feature that a fit is made to: its square is a number, too."""


def slices_of(features: Features) -> SavedSlices | None:
    """The features' slices as files hold them; None if they have none."""
    return None if features.slices is None else features.slices.saved(features.atoms)


def distance_outside(atoms: FloatArray, outside: BoolArray, features: Features) -> FloatArray:
    """Distance from the box, or a slice of it, as a share of its span, of what is furthest out; shape (n,).

    Parameters
    ----------
    atoms
        Values of the features' atoms, shape (n, a).
    outside
        Which samples lie outside, shape (n,); the others get 0.
    features
        Features whose box is learned.
    """
    distance = np.zeros(len(atoms))
    if outside.any():
        box = _box(features)
        away = np.maximum(box.low - atoms[outside], atoms[outside] - box.high) / box.span
        distance[outside] = np.maximum(away.max(axis=1), 0.0)
        if features.slices is not None:
            jointly = features.slices.excess(atoms[outside]).max(axis=1)
            distance[outside] = np.maximum(distance[outside], jointly)
    return distance


def _box(features: Features) -> Box:
    spans = np.array([features.box[atom.text] for atom in features.atoms])
    return Box(spans[:, 0], spans[:, 1])


TURNS = 0.2
"""Share of the span that temperature has to move each way for its direction to tell anything."""


def ways_moved(temperatures: Sequence[FloatArray]) -> frozenset[str]:
    """Which ways, ``up`` and ``down``, temperature moves by a fifth of its span, in all runs together."""
    moved = {"up": 0.0, "down": 0.0}
    low, high = np.inf, -np.inf
    for T in temperatures:
        low, high = min(low, float(T.min())), max(high, float(T.max()))
        # Averages over a hundredth of the run keep the sensor's noise from adding up as motion.
        parts = np.array([part.mean() for part in np.array_split(T, min(100, len(T)))])
        steps = np.diff(parts)
        moved["up"] += float(steps[steps > 0].sum())
        moved["down"] -= float(steps[steps < 0].sum())
    return frozenset(way for way, by in moved.items() if by > TURNS * (high - low))


def moves_both_ways(temperatures: Sequence[FloatArray]) -> bool:
    """Whether temperature rises and falls by a fifth of its span or more, in all runs together."""
    return len(ways_moved(temperatures)) == 2


def each_moves_both_ways(temperatures: Sequence[FloatArray]) -> bool:
    """Whether every run's temperature does: its course tells drift with temperature from drift in time."""
    return all(moves_both_ways([T]) for T in temperatures)


def direction_is_told(temperatures: Sequence[FloatArray]) -> bool:
    """Whether what the direction of temperature does is told beside what shifts a run as a whole.

    It is by a run that moves both ways, or by runs of one way each of which both ways are left whichever run
    is left out. Of a run up and a run down, a shift from run to run looks like direction, and no run left out
    can tell: what is left moves one way only.
    """
    if any(moves_both_ways([T]) for T in temperatures):
        return True
    runs = list(temperatures)
    return len(runs) > 2 and all(moves_both_ways(runs[:i] + runs[i + 1 :]) for i in range(len(runs)))


LEAST_SPAN_DEGC = 5.0
"""Span of temperature below which what was learned holds at that temperature alone [degC]: less than a room
changes in a day, and a few percent of what gyros are used over."""
LEAST_STEPS = 10.0
"""Steps of a sensor's resolution that a span must hold to tell a slope."""


def refusals(runs: Sequence[Run]) -> list[str]:
    """What training runs can't tell because temperature hardly moves in them, and what to record next."""
    temperatures = [run.temperature("T") for run in runs]
    low, high = min(float(T.min()) for T in temperatures), max(float(T.max()) for T in temperatures)
    span = high - low
    if span == 0.0:
        return [
            f"one temperature only, {short(low, 4)} degC: nothing can be told of drift over temperature; "
            "record a ramp up and a ramp down over the range of use"
        ]
    steps = [np.diff(np.unique(T)) for T in temperatures]
    resolution = min((float(step.min()) for step in steps if len(step)), default=0.0)
    if span < LEAST_STEPS * resolution:
        return [
            f"T spans {short(span)} degC, {span / resolution:.0f} steps of its sensor: that tells no slope; "
            "record a wider range, or with a finer sensor"
        ]
    if span < LEAST_SPAN_DEGC:
        return [
            f"T spans {short(span)} degC in the training runs, under {LEAST_SPAN_DEGC:g} degC: what is "
            f"compensated holds at {short(0.5 * (low + high))} degC alone; record a ramp up and a ramp down "
            "over the range of use"
        ]
    return []


def check_suits(features: Features, runs: Sequence[Run]) -> None:
    """Refuse features that training runs can tell nothing of."""
    for atom in features.atoms:
        told = unsuited(atom, runs)
        if told is not None:
            at = features.text.index(atom.text)
            message, hint = told
            raise InputError(f"{message}\n  {features.text}\n  {' ' * at}^\n{hint}")


def unsuited(atom: Atom, runs: Sequence[Run]) -> tuple[str, str] | None:
    """What is wrong with an atom for training runs, and what to do; None where they suit it."""
    if atom.operator in ("lag", "since_on"):
        longest = max(float(run.time[-1] - run.time[0]) for run in runs)
        coarsest = max(runs, key=lambda run: run.sample_s)
        if atom.memory > longest:
            return (
                f"a time constant of {atom.memory:g} s, but the longest training run is "
                f"{short(longest, 4)} s",
                "record longer, or state a time constant within the runs",
            )
        if atom.operator == "lag" and atom.memory < coarsest.sample_s * (1.0 - 1e-6):
            return (
                f"{coarsest.name}: a time constant of {atom.memory:g} s, but samples are "
                f"{coarsest.sample_s:g} s apart",
                f"state at least {coarsest.sample_s:g} s",
            )
    if atom.operator == "play" and TIME_ON not in atom.signal.sensors:
        values = [atom.signal.values(run) for run in runs]
        span = max(float(v.max()) for v in values) - min(float(v.min()) for v in values)
        if 2.0 * atom.memory > span:
            return (
                f"a half width of {atom.memory:g}, but {atom.signal.text} spans {short(span, 4)} in the "
                "training runs, less than the play",
                f"state at most {short(0.5 * span)}, or train over a wider range",
            )
    return None
