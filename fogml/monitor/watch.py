"""Units in service by their records: in order, judged for change, trends, and when to calibrate again."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from itertools import groupby
from typing import Literal

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError, listed
from fogml.monitor.changes import Chart, Shape, change_chart
from fogml.monitor.evidence import ChangePrior
from fogml.monitor.record import FIGURES, RunRecord
from fogml.monitor.trend import trend_interval
from fogml.numerals import in_order_of_serial, plural

DAY_S = 86400.0
NEAREST: dict[tuple[str, Shape], tuple[str, ...]] = {
    ("level", "step"): ("turn_on_bias", "thermal_shock", "magnetic", "mount_tilt"),
    ("level", "ramp"): ("ageing", "moisture", "stress_relaxation"),
    ("temperature_slope", "step"): ("bias_polynomial", "polarization_nonreciprocity", "glass_transition"),
    ("temperature_slope", "ramp"): ("ageing", "light_power", "moisture"),
    ("rate_slope", "step"): ("shupe_pure", "temperature_rate_product", "sensor_lag", "sensor_placement"),
    ("rate_slope", "ramp"): ("stress_relaxation", "moisture"),
    ("scatter", "step"): ("angle_random_walk", "outliers_dropouts", "vibration_noise", "loop_gain"),
    ("scatter", "ramp"): ("arw_physics", "radiation_noise", "light_power"),
    ("scale_factor", "step"): ("source_wavelength", "halfwave_voltage", "table_rate_error"),
    ("scale_factor", "ramp"): ("source_wavelength", "radiation", "halfwave_voltage"),
}
"""Effects of the catalogue that change a figure so, the usual first; the diagnosis of the runs tells more."""
LONGEST_DAYS = 36500.0
"""How far ahead a calibration is foretold [d]: what is later is said to be later."""
EPOCHS = (datetime(1970, 1, 1), datetime(1980, 1, 1), datetime(2000, 1, 1))
"""Where clocks of loggers begin that were never set: Unix; DOS, and GPS within a week; real-time chips."""
UNSET_CLOCK = timedelta(days=31)
"""How long after its epoch a clock is taken for one never set: longer than runs are."""
State = Literal["baseline", "steady", "alarm"]


@dataclass(frozen=True)
class Calibration:
    """When what is left grows beyond what the model states, if it goes on as it does.

    Attributes
    ----------
    limit
        Greatest change of the level [deg/h].
    trend, trend_ci90
        The level's slope over the runs since the last change [deg/h per day], median and interval, a bias
        that wanders between the runs being allowed for unless it is known not to.
    due_days, due_ci90
        Days from the last run until the level's change passes the limit: most likely, and the interval that
        holds it with 90 %; infinite where it does not within a hundred years.
    """

    limit: float
    trend: float
    trend_ci90: tuple[float, float]
    due_days: float
    due_ci90: tuple[float, float]


@dataclass(frozen=True)
class UnitWatch:
    """A unit in service.

    Attributes
    ----------
    unit, axis
        Serial number and axis.
    records
        Its runs in order.
    age
        Age at each run [d], or its number from 0 where runs do not say when they began, shape (n,).
    dated
        Whether the ages are days.
    chart
        The evidence of change after each run, and the alarms.
    state
        ``baseline`` while there are too few runs, ``alarm`` once the figures changed under this model, else
        ``steady``.
    calibration
        When to calibrate again; None where too few runs tell it.
    notes
        What a reader should know.
    """

    unit: str
    axis: str
    records: tuple[RunRecord, ...]
    age: FloatArray
    dated: bool
    chart: Chart
    state: State
    calibration: Calibration | None
    notes: tuple[str, ...]

    @property
    def label(self) -> str:
        """Serial number and axis."""
        return self.records[0].label

    def figure(self, name: str) -> FloatArray:
        """A figure of each run, in its unit, shape (n,)."""
        return np.array([getattr(record, name) for record in self.records])


def watch(
    records: Iterable[RunRecord],
    *,
    runs_between_false_alarms: float = 1000.0,
    bias_limit: float | None = None,
    prior: ChangePrior | None = None,
) -> list[UnitWatch]:
    """Units in service, in order of their names; whatever order the records come in.

    Parameters
    ----------
    records
        Of any units.
    runs_between_false_alarms
        Least mean number of a unit's runs until a false alarm.
    bias_limit
        Change of the level that asks for a calibration [deg/h]; by default half the width of the model's
        90 % interval inside training.
    prior
        What is taken for granted of changes.

    Raises
    ------
    InputError
        If the limit is no positive number, or the number of runs is below 1.
    """
    if bias_limit is not None and not 0.0 < bias_limit < np.inf:
        raise InputError(f"bias limit {bias_limit:g} deg/h: a positive number is needed")
    ordered = sorted(records, key=lambda record: (record.unit, record.axis))
    units = [
        _watched(list(group), runs_between_false_alarms, bias_limit, prior or ChangePrior())
        for _, group in groupby(ordered, key=lambda record: (record.unit, record.axis))
    ]
    alike: dict[tuple[str, str], list[UnitWatch]] = {}
    for unit in units:
        alike.setdefault((_as_read(unit.unit), _as_read(unit.axis)), []).append(unit)
    return [_beside(unit, alike[_as_read(unit.unit), _as_read(unit.axis)]) for unit in units]


def _as_read(name: str) -> str:
    """A name as people read it, whatever its case, spaces and widths of letters."""
    return " ".join(unicodedata.normalize("NFKC", name).casefold().split())


def _beside(unit: UnitWatch, alike: Sequence[UnitWatch]) -> UnitWatch:
    """The unit, with a note where others are named like it: runs of one unit may be split over them."""
    others = [f"'{other.unit}' {other.axis}".strip() for other in alike if other is not unit]
    if not others:
        return unit
    note = (
        f"'{unit.unit}' and {listed(others, 3)} are kept as units of their own and differ in case, spaces or "
        "widths of letters alone; where they are one, state one name in the side files and give all runs "
        "again with another --store"
    )
    return replace(unit, notes=(*unit.notes, note))


def _watched(
    records: list[RunRecord], between: float, bias_limit: float | None, prior: ChangePrior
) -> UnitWatch:
    unset = [record.run for record in records if clock_not_set(record)]
    started = [datetime.fromisoformat(record.started) for record in records if record.started]
    zones = len({moment.tzinfo is None for moment in started}) > 1
    dated = len(started) == len(records) and not unset and not zones
    records, age = _in_order(records, dated)
    notes = []
    if zones:
        notes.append(
            "'started' has a time zone in some of the runs only: they stand in the order in which they were "
            "monitored; add it in their side files and give the runs again"
        )
    if unset:
        notes.append(
            f"{listed(unset, 3)}: 'started' is what a clock says that was never set, and so not taken; mend "
            "it in the side file and give the run again"
        )
    if not dated and not zones and len(records) > 1:
        notes.append(
            "not every run says when it began: they stand in the order in which they were monitored; "
            "state 'started' in their side files and give the runs again"
        )
    last = records[-1]
    alike = (last.model, last.averaging_s)
    if any((record.model, record.averaging_s) != alike for record in records):
        notes.append("model or averaging time were exchanged: runs by another are left out of the charts")
        kept = [i for i, record in enumerate(records) if (record.model, record.averaging_s) == alike]
        records, age = [records[i] for i in kept], age[kept]
    figures = {name: np.array([getattr(record, name) for record in records]) for name in FIGURES}
    errors = {name: np.array([getattr(record, f"{name}_se") for record in records]) for name in FIGURES}
    chart = change_chart(figures, age, between, prior, errors)
    first = chart.changes[-1].onset if chart.changes else 0
    since = len(records) - chart.begins
    state: State = "alarm" if chart.changes else "steady"
    if not chart.changes and len(records) <= prior.baseline_runs:
        state = "baseline"
    if since <= prior.baseline_runs:
        notes.append(
            f"{plural(since, 'run')} {'since the change' if chart.changes else 'so far'}: no change can be "
            f"told yet, {prior.baseline_runs + 2} are the least that tell one"
        )
    # Of a run outside training the interval is wider than the model states it.
    limit = bias_limit or min(record.half_width for record in records)
    return UnitWatch(
        unit=last.unit,
        axis=last.axis,
        records=tuple(records),
        age=age,
        dated=dated,
        chart=chart,
        state=state,
        calibration=_calibration(
            age[first:], chart.usual("level", figures["level"])[first:], limit, any(prior.wander)
        )
        if dated
        else None,
        notes=tuple(notes),
    )


def clock_not_set(record: RunRecord) -> bool:
    """Whether a run began, by its own account, where clocks begin."""
    if not record.started:
        return False
    started = datetime.fromisoformat(record.started)
    started = started if started.tzinfo is None else started.astimezone(UTC).replace(tzinfo=None)
    return any(timedelta(0) <= started - epoch < UNSET_CLOCK for epoch in EPOCHS)


def _in_order(records: Sequence[RunRecord], dated: bool) -> tuple[list[RunRecord], FloatArray]:
    """Runs by when they began, with the unit's age [d]; by when they were monitored if not all say.

    Of one run under two models the later record is the last: which model counts is no matter of chance.
    """
    if not dated:
        placed = sorted(records, key=lambda record: (record.monitored, *_named(record)))
        return placed, np.arange(float(len(placed)))
    moments = {record.key: datetime.fromisoformat(record.started) for record in records}
    placed = sorted(records, key=lambda record: (moments[record.key], record.monitored, *_named(record)))
    first = moments[placed[0].key]
    return placed, np.array([(moments[r.key] - first).total_seconds() / DAY_S for r in placed])


def _named(record: RunRecord) -> tuple[list[tuple[int, int | str]], str]:
    """What orders runs of one moment: the numbers in their names, so that run 10 follows run 9."""
    return in_order_of_serial(record.run), record.key


def _calibration(age: FloatArray, level: FloatArray, limit: float, wanders: bool) -> Calibration | None:
    """When a line through the levels passes a limit; None for fewer than four runs that tell theirs."""
    told = np.isfinite(level)
    if told.sum() < 4 or not np.ptp(age[told]) > 0.0:
        return None
    trend, (low, high) = trend_interval(age[told], level[told], wanders=wanders)

    def due(slope: float) -> float:
        """Days from the last run until a line of that slope has gone as far as the limit."""
        days = limit / abs(slope) - float(age[-1] - age[told][0]) if slope else np.inf
        return max(days, 0.0) if days <= LONGEST_DAYS else float("inf")

    latest = float("inf") if low <= 0.0 <= high else due(min(low, high, key=abs))
    return Calibration(limit, trend, (low, high), due(trend), (due(max(low, high, key=abs)), latest))
