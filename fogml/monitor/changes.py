"""When a figure of a unit changed from run to run, with a stated rate of false alarms.

Without a change a figure of consecutive runs is taken for independent and normal, of unknown mean and
deviation. A change that began with run j adds a step, or a ramp in the unit's age. For each j the evidence is
the ratio of the two marginal likelihoods under the right-invariant prior of mean and deviation,

    B = (1 + g**2 v)**(-1/2) * (S0 / (S0 - g**2 b**2 / (1 + g**2 v)))**((n - 1) / 2),

S0 the sum of squares about the mean, v that of the change's centred column, b its product with the values,
and g the size's deviation before the data, in deviations of the figure (H. Jeffreys, *Theory of
Probability*, 3rd ed., 1961; the ratio as an e-value: M. Perez-Ortiz, T. Lardy, R. de Heide & P. Grunwald,
"E-statistics, group invariance and anytime-valid testing", Ann. Statist. 52, 2024). Without a change the sum
over j, less the number of runs, is a martingale: an alarm once the sum passes A comes falsely no sooner than
after A runs in the mean, whatever mean and deviation are (S. W. Roberts, "A comparison of some control chart
procedures", Technometrics 8, 1966; J. Shin, A. Ramdas & A. Rinaldo, "E-detectors", 2023).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.stats import t as student

from fogml.errors import InputError
from fogml.runs.run import FloatArray

Shape = Literal["step", "ramp"]
SHAPES: tuple[Shape, ...] = ("step", "ramp")


@dataclass(frozen=True)
class ChangePrior:
    """What is taken for granted of changes.

    Attributes
    ----------
    baseline_runs
        Runs before the first that a change can begin with: a deviation needs two, and with three its
        estimate is no longer off by orders of magnitude.
    sizes
        Deviations that a step's size may have, in deviations of the figure between runs; equally likely. In
        octaves from what hides between runs to what nobody overlooks.
    ramp_sizes
        The same of what a ramp adds in the mean interval between the baseline's runs.
    """

    baseline_runs: int = 3
    sizes: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0, 16.0)
    ramp_sizes: tuple[float, ...] = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)


@dataclass(frozen=True)
class Change:
    """An alarm: a figure of a unit's runs changed.

    Attributes
    ----------
    raised_at
        Index of the run with which the evidence passed the limit.
    onset, onset_ci90
        Index of the run that the change most likely began with, and of the first and the last of those that
        hold 90 % of the probability.
    figure
        The figure that changed, most likely.
    shape
        ``step``, or ``ramp`` over the unit's age.
    size, size_ci90
        How far a step goes in the figure's unit, or what a ramp adds per unit of age, by least squares with
        the interval of Student's t.
    statistic
        Sum of the evidences, against the limit.
    probability
        Of this figure and shape among all.
    """

    raised_at: int
    onset: int
    onset_ci90: tuple[int, int]
    figure: str
    shape: Shape
    size: float
    size_ci90: tuple[float, float]
    statistic: float
    probability: float


@dataclass(frozen=True)
class Chart:
    """The evidence of change after each of n runs, and the alarms that it raised.

    Attributes
    ----------
    statistic
        Sum of the evidences, shape (n,); after an alarm it begins anew with the runs from its onset on.
    changes
        The alarms, in order.
    """

    statistic: FloatArray
    changes: tuple[Change, ...]


def change_chart(
    figures: Mapping[str, FloatArray],
    age: FloatArray,
    runs_between_false_alarms: float,
    prior: ChangePrior | None = None,
) -> Chart:
    """The evidence that figures of consecutive runs changed.

    Takes O(n**2) time for n runs.

    Parameters
    ----------
    figures
        Values by name, each of shape (n,); NaN where a run does not tell it.
    age
        Age of the unit at each run, in any unit, increasing, shape (n,).
    runs_between_false_alarms
        Least mean number of runs until a false alarm, where nothing changes.
    prior
        What is taken for granted.

    Raises
    ------
    InputError
        If arrays differ in length, ages go back, or the number of runs is below 1.

    Examples
    --------
    >>> import numpy as np
    >>> level = np.random.default_rng(0).normal(size=30)
    >>> level[20:] += 6.0
    >>> chart = change_chart({"level": level}, np.arange(30.0), 1000.0)
    >>> [(change.onset, change.figure, change.shape) for change in chart.changes]
    [(20, 'level', 'step')]
    """
    prior = prior or ChangePrior()
    age = np.asarray(age, dtype=np.float64)
    for name, values in figures.items():
        if np.shape(values) != age.shape:
            raise InputError(f"figure '{name}' has shape {np.shape(values)}, the ages {age.shape}")
    if np.any(np.diff(age) < 0.0):
        raise InputError("the ages of a unit's runs go back; put the runs in order")
    if not runs_between_false_alarms >= 1.0:
        raise InputError(f"{runs_between_false_alarms} runs between false alarms: at least 1 is needed")
    statistic = np.zeros(len(age))
    changes: list[Change] = []
    first = 0
    place = 0
    while place < len(age):
        found = _evidence(figures, age, first, place, prior)
        statistic[place] = np.exp(min(found.total, 700.0))
        if statistic[place] >= runs_between_false_alarms:
            change = found.change(first, place, statistic[place])
            changes.append(change)
            first = max(change.onset, first + 1)
        place += 1
    return Chart(statistic, tuple(changes))


@dataclass(frozen=True)
class _Evidence:
    """Log evidence of each figure [shape (onsets, shapes)] with its runs, ages and values."""

    logs: Mapping[str, FloatArray]
    rows: Mapping[str, FloatArray]
    values: Mapping[str, FloatArray]
    ages: Mapping[str, FloatArray]
    baseline: int
    total: float

    def change(self, first: int, place: int, statistic: float) -> Change:
        """The most likely of the changes."""
        mass = {
            (name, s): float(np.logaddexp.reduce(logs[:, s]))
            for name, logs in self.logs.items()
            for s in range(len(SHAPES))
        }
        name, s = max(mass, key=lambda key: mass[key])
        shares = np.exp(self.logs[name][:, s] - mass[name, s])
        onsets = self.rows[name][self.baseline :].astype(np.intp)
        best = int(np.argmax(shares))
        likely = np.argsort(-shares)
        held = likely[: int(np.searchsorted(np.cumsum(shares[likely]), 0.9)) + 1]
        size, half = _size(self.values[name], self.ages[name], self.baseline + best, SHAPES[s])
        return Change(
            raised_at=place,
            onset=int(onsets[best]),
            onset_ci90=(int(onsets[held.min()]), int(onsets[held.max()])),
            figure=name,
            shape=SHAPES[s],
            size=size,
            size_ci90=(size - half, size + half),
            statistic=float(statistic),
            probability=float(np.exp(mass[name, s] - np.logaddexp.reduce(list(mass.values())))),
        )


def _evidence(
    figures: Mapping[str, FloatArray], age: FloatArray, first: int, place: int, prior: ChangePrior
) -> _Evidence:
    """The evidence of change in the runs `first` to `place`."""
    logs, rows, values, ages = {}, {}, {}, {}
    for name, figure in figures.items():
        told = first + np.flatnonzero(np.isfinite(figure[first : place + 1]))
        if len(told) <= prior.baseline_runs:
            continue
        rows[name], values[name], ages[name] = told.astype(np.float64), figure[told], age[told]
        logs[name] = _log_ratios(values[name], ages[name], prior) - np.log(len(SHAPES) * len(figures))
    total = (
        float(np.logaddexp.reduce(np.concatenate([one.ravel() for one in logs.values()])))
        if logs
        else -np.inf
    )
    return _Evidence(logs, rows, values, ages, prior.baseline_runs, total)


def _log_ratios(y: FloatArray, age: FloatArray, prior: ChangePrior) -> FloatArray:
    """Log ratio of marginal likelihoods for each onset from the baseline on and shape, shape (m, 2)."""
    n, start = len(y), prior.baseline_runs
    centred = y - y.mean()
    about = float(centred @ centred)
    found = np.zeros((n - start, len(SHAPES)))
    if about <= n * np.square(np.spacing(np.abs(y).max())):
        return np.full_like(found, -np.inf)
    interval = (age[start - 1] - age[0]) / (start - 1)
    age = age / interval if interval > 0.0 else np.arange(float(n))
    for s, sizes in enumerate((prior.sizes, prior.ramp_sizes)):
        v, b = _column(centred, age, start, s)
        g2 = np.square(sizes)[:, None]
        gained = g2 * b**2 / (1.0 + g2 * v) / about
        ratios = -0.5 * np.log1p(g2 * v) - 0.5 * (n - 1) * np.log1p(-np.minimum(gained, 1.0 - 1e-15))
        found[:, s] = np.logaddexp.reduce(ratios, axis=0) - np.log(len(sizes))
    return found


def _column(centred: FloatArray, age: FloatArray, start: int, shape: int) -> tuple[FloatArray, FloatArray]:
    """Sum of squares of a change's centred column and its product with the values, each by onset, (m,)."""
    n = len(centred)
    onsets = np.arange(start, n)
    count, tail = n - onsets, np.cumsum(centred[::-1])[::-1][onsets]
    if SHAPES[shape] == "step":
        return count * (1.0 - count / n), tail
    age = age - age[-1]
    origin = age[onsets - 1]
    sums, squares, products = (np.cumsum(part[::-1])[::-1][onsets] for part in (age, age**2, age * centred))
    total = sums - count * origin
    return squares - 2.0 * origin * sums + count * origin**2 - total**2 / n, products - origin * tail


def _size(y: FloatArray, age: FloatArray, onset: int, shape: Shape) -> tuple[float, float]:
    """A change's size by least squares, and the half-width of its 90 % interval."""
    n = len(y)
    after = np.arange(n) >= onset
    column = after.astype(np.float64) if shape == "step" else np.where(after, age - age[onset - 1], 0.0)
    column = column - column.mean()
    v = float(column @ column)
    if v == 0.0:
        return 0.0, np.inf
    size = float(column @ y) / v
    left = y - y.mean() - size * column
    return size, float(student.ppf(0.95, n - 2) * np.sqrt(left @ left / (n - 2) / v))
