"""The run: one continuous recording of one gyro, as immutable columns and set-up facts."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from types import MappingProxyType
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.errors import InputError
from fogml.runs.arrival_times import sampling_times
from fogml.runs.attitude import reference_deg_h, with_table_axis
from fogml.runs.columns import coil_sensor_number, is_temperature
from fogml.runs.dropouts import RULE, DropoutRule, Reading, last_reading, read_thermometer
from fogml.runs.exchange import Exchange, checked_facts
from fogml.runs.facts import Facts
from fogml.runs.findings import Finding, first_of_all
from fogml.runs.possible import as_vector, check_columns, check_forwards
from fogml.signals import large
from fogml.signals.clock import Clock, gap_starts


@dataclass(frozen=True, eq=False)
class Run(Exchange):
    """One recording: columns of float64 in internal units, in time order, and facts.

    Columns are read-only copies of what is given; slices and stretches are views on the same memory.

    Attributes
    ----------
    name
        Base name of the file it came from, or a name of one's own.
    columns
        Column name to values of shape (n,), internal units of the run format; ``time`` and
        ``gyro`` are always there.
    facts
        Set-up facts.
    gyro_unit
        ``deg/h``, or ``count`` where the output was recorded in counts.
    findings
        What was noticed on reading.
    """

    name: str
    columns: Mapping[str, FloatArray]
    facts: Facts = field(default_factory=Facts)
    gyro_unit: Literal["deg/h", "count"] = "deg/h"
    findings: tuple[Finding, ...] = ()
    _rule: ClassVar[DropoutRule] = RULE

    def __post_init__(self) -> None:
        """Check the columns as a file's reader does.

        Times given as dates are converted to seconds since the first. Times of arrival in bursts are
        replaced by those of sampling, which is noted in the findings.

        Raises
        ------
        InputError
            Naming the run, the column and the first sample at fault: no vector of numbers, of another
            length, missing or infinite, time that goes back or repeats, or is in too coarse a precision.
        """
        self._check_set_up()
        columns = {name: as_vector(self.name, name, values).copy() for name, values in self.columns.items()}
        check_columns(self.name, columns)
        self._freeze(columns)
        time, finding = sampling_times(columns)
        if finding is not None:
            self._freeze({**columns, "time": time})
            object.__setattr__(self, "findings", (*self.findings, finding))

    def _freeze(self, columns: Mapping[str, FloatArray]) -> None:
        """Take columns as read-only views of one length."""
        frozen = {name: np.asarray(values, dtype=np.float64).view() for name, values in columns.items()}
        for values in frozen.values():
            values.flags.writeable = False
        for name in (name for name in ("time", "gyro") if name not in frozen):
            raise InputError(f"{self.name}: no column '{name}'; a run always needs time and gyro")
        lengths = {name: values.shape for name, values in frozen.items()}
        if len(set(lengths.values())) > 1 or frozen["time"].ndim != 1:
            raise InputError(f"{self.name}: columns differ in length: {lengths}")
        object.__setattr__(self, "columns", MappingProxyType(frozen))

    @classmethod
    def derived(
        cls,
        name: str,
        columns: Mapping[str, FloatArray],
        facts: Facts | None = None,
        gyro_unit: Literal["deg/h", "count"] = "deg/h",
        findings: tuple[Finding, ...] = (),
    ) -> Run:
        """A run of columns that were checked before, such as a part of a run."""
        run = object.__new__(cls)
        run.__dict__.update(name=name, facts=facts or Facts(), gyro_unit=gyro_unit, findings=findings)
        run._freeze(columns)
        return run

    @classmethod
    def from_columns(cls, name: str = "run", facts: Facts | None = None, **columns: ArrayLike) -> Run:
        """A run from arrays in internal units: ``Run.from_columns(time=t, gyro=g, T=temperature)``."""
        return cls(name, columns, facts or Facts())  # type: ignore[arg-type]

    def __len__(self) -> int:
        return len(self.columns["time"])

    def __repr__(self) -> str:
        return f"Run({self.name!r}, {len(self)} samples, {', '.join(self.columns)})"

    @property
    def time(self) -> FloatArray:
        """Time [s], shape (n,)."""
        return self.columns["time"]

    @property
    def gyro(self) -> FloatArray:
        """Gyro output as recorded [deg/h, or counts], shape (n,)."""
        return self.columns["gyro"]

    @cached_property
    def gyro_deg_h(self) -> FloatArray:
        """Gyro output as rate [deg/h], shape (n,); counts are divided by the nominal K0.

        Raises
        ------
        InputError
            If the output is in counts and no scale factor is stated.
        """
        if self.gyro_unit == "deg/h":
            return self.gyro
        if self.facts.scale_factor is None:
            raise InputError(
                f"{self.name}: column 'gyro' is in counts and no scale factor is stated; add "
                "'scale_factor: {value: ..., unit: \"count per deg/h\"}' to the side file"
            )
        count_per_deg_h = self.facts.scale_factor.count_per_deg_h
        return large.each(lambda gyro: gyro / count_per_deg_h, self.gyro)

    @cached_property
    def rate(self) -> FloatArray:
        """Table rate about the input axis [deg/s], shape (n,); zeros where not recorded."""
        return self.columns["rate"] if "rate" in self.columns else np.zeros(len(self))

    @property
    def earth_known(self) -> bool:
        """Whether the facts tell the Earth rate along the input axis."""
        return self.facts.earth_rate_deg_h is not None

    @cached_property
    def reference_deg_h(self) -> FloatArray:
        """Reference rate [deg/h], shape (n,): table rate plus Earth rate, as the table's angle turns it."""
        return reference_deg_h(self.facts, self.rate, self.columns.get("angle"))

    @cached_property
    def error_deg_h(self) -> FloatArray:
        """Gyro output less reference rate [deg/h], shape (n,): what a drift model describes."""
        return large.each(np.subtract, self.gyro_deg_h, self.reference_deg_h)

    @cached_property
    def temperature_columns(self) -> tuple[str, ...]:
        """Names of the recorded temperatures."""
        return tuple(name for name in self.columns if is_temperature(name))

    def temperature(self, name: str = "T") -> FloatArray:
        """A temperature [degC] by its name in formulas, shape (n,).

        Readings that are none are replaced by the last good one (`read_thermometer`).
        ``T`` is the column T, else T_in, else the mean of the odd coil sensors; ``T_in`` and
        ``T_out`` stand for the means of the odd and even sensors where only T1 ... are recorded.

        Raises
        ------
        InputError
            If the run does not hold that temperature.
        """
        sensors = self.sensors(name)
        if len(sensors) == 1:
            return self._readings[sensors[0]].values
        if sensors:
            return self._sensor_mean(sensors)
        held = ", ".join(self.temperature_columns) or "none"
        raise InputError(
            f"{self.name}: no temperature '{name}'; the run holds {held}; call the column that measures it "
            f"'{name} [degC]', or let an import profile join the log that does"
        )

    def sensors(self, name: str = "T") -> tuple[str, ...]:
        """The columns that a temperature is the mean of; none where the run does not hold it."""
        if name in self.columns and is_temperature(name):
            return (name,)
        stand_in = "T_in" if name == "T" else name
        if stand_in in self.columns and is_temperature(stand_in):
            return (stand_in,)
        if stand_in not in ("T_in", "T_out"):
            return ()
        parity = 1 if stand_in == "T_in" else 0
        numbers = {c: coil_sensor_number(c) for c in self.columns}
        return tuple(c for c, number in numbers.items() if number is not None and number % 2 == parity)

    def _sensor_mean(self, sensors: tuple[str, ...]) -> FloatArray:
        means: dict[tuple[str, ...], FloatArray] = self.__dict__.setdefault("_sensor_means", {})
        if sensors not in means:
            means[sensors] = large.each(
                lambda *x: np.mean(x, axis=0), *(self._readings[c].values for c in sensors)
            )
        return means[sensors]

    @cached_property
    def _readings(self) -> dict[str, Reading]:
        held = {name: self.columns[name] for name in self.temperature_columns}
        return {name: read_thermometer(self.time, values, self._rule) for name, values in held.items()}

    def read_by(self, rule: DropoutRule) -> Run:
        """The run, its thermometers read by a rule of one's own: what is no reading by that is held."""
        known: dict[DropoutRule, Run] = self.__dict__.setdefault("_read_by", {})
        if rule not in known and rule != self._rule:
            (run := self._with(self.columns)).__dict__.update(_rule=rule, clock=self.clock)
            known[rule] = run
        return known.get(rule, self)

    def after(self, before: Run) -> Run:
        """The run behind the one before it as one, with the columns of that.

        What the thermometers showed before tells which readings of this one are none.
        """
        columns = {name: np.concatenate([x, self.columns[name]]) for name, x in before.columns.items()}
        joined = Run.derived(self.name, columns, self.facts, self.gyro_unit)
        readings = {}
        for name in before.temperature_columns:
            first = before._readings[name]
            state = last_reading(before.time, before.columns[name], first)
            second = read_thermometer(self.time, self.columns[name], before._rule, state)
            bad = None
            if first.bad is not None or second.bad is not None:
                parts = ((first, len(before)), (second, len(self)))
                bad = np.concatenate([np.zeros(n, bool) if r.bad is None else r.bad for r, n in parts])
            readings[name] = Reading(np.concatenate([first.values, second.values]), bad)
        joined.__dict__.update(_rule=before._rule, _readings=readings)
        return joined

    def end(self, start: int, names: Iterable[str]) -> Run:
        """A copy of some columns from a sample on, which keeps nothing else in memory."""
        columns = {name: self.columns[name][start:].copy() for name in names}
        part = Run.derived(self.name, columns, self.facts, self.gyro_unit)
        readings = {
            name: Reading(r.values[start:].copy(), None if r.bad is None else r.bad[start:].copy())
            for name, r in self._readings.items()
        }
        part.__dict__.update(_rule=self._rule, _readings=readings)
        return part

    def dropouts(self, name: str) -> BoolArray | None:
        """Samples at which a `temperature` was not measured, shape (n,); None where it always was."""
        masks = [bad for sensor in self.sensors(name) if (bad := self._readings[sensor].bad) is not None]
        return np.logical_or.reduce(masks) if masks else None

    @property
    def without_dropouts(self) -> Run:
        """The run with each temperature that was not measured replaced by the last good reading."""
        changed = {name: r.values for name, r in self._readings.items() if r.bad is not None}
        return self._with({**self.columns, **changed}) if changed else self

    @cached_property
    def clock(self) -> Clock:
        """The sample times as the window operators take them."""
        return Clock(self.time)

    @cached_property
    def sample_s(self) -> float:
        """Median sample interval [s]; 0 for a run of one sample."""
        return self.clock.sample_s

    @cached_property
    def gap_starts(self) -> IndexArray:
        """Indices of the samples that follow a gap longer than 3 median sample intervals."""
        return gap_starts(self.time, self.sample_s)

    @cached_property
    def stretches(self) -> tuple[slice, ...]:
        """The parts between gaps, as slices over the samples."""
        return tuple(slice(a, b) for a, b in pairwise([0, *self.gap_starts.tolist(), len(self)]))

    @property
    def span_s(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0]) if len(self) else 0.0

    @cached_property
    def hash(self) -> str:
        """SHA-256 over the columns' names and values, as hexadecimal digits."""
        digest = hashlib.sha256(self.gyro_unit.encode())
        for name in sorted(self.columns):
            digest.update(name.encode())
            for part in large.pieces(values := self.columns[name]):
                digest.update(np.ascontiguousarray(values[part]).data)
        return digest.hexdigest()

    def __getitem__(self, part: slice | BoolArray) -> Run:
        """A part of the run in its order: views by a slice, ``run[100:200]``, copies by a mask."""
        check_forwards(self.name, part)
        facts = with_table_axis(self.facts, self.rate)
        return self._with({name: values[part] for name, values in self.columns.items()}, facts=facts)

    def with_columns(self, **columns: ArrayLike) -> Run:
        """The run with columns added or replaced (internal units)."""
        added = {name: as_vector(self.name, name, values).copy() for name, values in columns.items()}
        check_columns(self.name, added)
        return self._with({**self.columns, **added})

    def with_facts(self, facts: Facts) -> Run:
        """The run with other set-up facts."""
        return self._with(self.columns, facts=checked_facts(self.name, facts))

    def _with(self, columns: Mapping[str, FloatArray], **others: Any) -> Run:
        """The run with other columns, `facts` or `findings`, read by the same rule."""
        held = {"facts": self.facts, "gyro_unit": self.gyro_unit, "findings": self.findings, **others}
        run = Run.derived(self.name, columns, **held)
        run.__dict__["_rule"] = self._rule
        return run

    def with_findings(self, findings: Iterable[Finding]) -> Run:
        """The run with more findings; those come first that make every figure wrong."""
        return self._with(self.columns, findings=tuple(first_of_all((*self.findings, *findings))))
