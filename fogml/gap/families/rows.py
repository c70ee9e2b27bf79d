"""A run as rows: what was recorded and what drives it, as means over spans of time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError
from fogml.gap.families.priors import Priors
from fogml.gap.families.readings import smoothed, window_difference
from fogml.runs.outliers import find_outliers
from fogml.runs.regimes import regimes
from fogml.runs.run import FloatArray, Run
from fogml.twin.effect import Effect, LoopEffect
from fogml.twin.inputs import Inputs
from fogml.twin.nominal import DELTA, DELTA_WINDOW_S, NAMES, nominal_columns
from fogml.twin.plant.estimate import estimate_nodes
from fogml.twin.replay import Replayer
from fogml.twin.twin import Twin

FEWEST_ROWS = 16
LEAST_FULL = 0.5
"""A row needs this share of its samples."""
SHORT_GAP = 0.25
"""Readings are linear over a gap of this share of the nominal's memory; a longer one is left out."""
SATURATED = 3
"""Neighbouring samples at the greatest or least value of all from which on it is a limit."""


class Unusable(InputError):
    """A run that a diagnosis can't use; others may do."""


@dataclass(frozen=True, eq=False)
class Rows:
    """One run, m rows.

    Attributes
    ----------
    run
        As recorded.
    gap
        Recorded less the twin's replay at its priors' means, shape (m,) [deg/h].
    recorded
        Recorded less reference, shape (m,) [deg/h].
    end_s, row_s
        Where each row ends [s], shape (m,), and how long it lasts.
    weight
        Square root of the share of its samples that a row has, shape (m,).
    constants
        Response to a unit of each nominal constant, shape (m, 8) [deg/h].
    even, kept
        Inputs on even rows without a gap, temperatures smooth; which of them are rows.
    readings
        Temperatures as they were read, by name, on the even rows.
    reading_noise
        Noise of one even row's smooth temperature, by name [degC].
    masked
        Samples left out, by why.
    """

    run: Run
    gap: FloatArray
    recorded: FloatArray
    end_s: FloatArray
    row_s: float
    weight: FloatArray
    constants: FloatArray
    even: Inputs
    kept: NDArray[np.bool_]
    readings: Mapping[str, FloatArray]
    reading_noise: Mapping[str, float]
    by_sample: _BySample
    masked: Mapping[str, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.gap)

    @property
    def turns(self) -> bool:
        """Whether the table turns."""
        return bool(np.any(self.even.table_rate)) or "angle" in self.even.drives

    @cached_property
    def temperature(self) -> FloatArray:
        """T of each row [degC], shape (m,)."""
        return self.even.temperature("T")[self.kept]

    @cached_property
    def time_s(self) -> FloatArray:
        """Middle of each row [s], shape (m,)."""
        return self.end_s - 0.5 * self.row_s

    @property
    def time(self) -> FloatArray:
        """As `time_s`."""
        return self.time_s

    @cached_property
    def regime(self) -> NDArray[np.int8]:
        """Regime of each row; see `fogml.runs.regimes`."""
        labels = regimes(self.run).labels
        at = np.clip(np.searchsorted(self.run.time, self.time_s), 0, len(labels) - 1)
        return np.asarray(labels[at])

    def of(self, values: FloatArray) -> FloatArray:
        """Rows of what is given on the even ones, shape (e, ...) to (m, ...)."""
        return values[self.kept]

    def response(
        self,
        declared: Effect,
        shape: Mapping[str, float],
        temperatures: Mapping[str, FloatArray] | None = None,
        constants: Mapping[str, float] | None = None,
    ) -> FloatArray:
        """Of an effect per unit of its amplitude [deg/h], shape (m,).

        `temperatures` take the place of those of the even rows; `constants` are those at which an effect
        meets output and slopes.
        """
        fast = {"rate", "angle", "output", "slopes", "earth"} & set(declared.needs)
        if self.turns and (fast or declared.stage in ("scale_factor", "rig", "loop")):
            inputs = self.by_sample.inputs(self.even, temperatures)
            values = declared.response(_meeting(inputs, constants), **shape)
            return self.of(self.by_sample.means(np.asarray(values, dtype=np.float64)))
        inputs = self.even.afresh()
        if temperatures:
            inputs = replace(inputs, temperatures={**inputs.temperatures, **temperatures}, cache={})
        values = declared.response(_meeting(inputs, constants), **shape)
        return self.of(np.broadcast_to(np.asarray(values, dtype=np.float64), self.kept.shape))

    def changed_output(
        self, declared: Effect, amplitude: float, constants: Mapping[str, float]
    ) -> FloatArray:
        """What an effect that meets the output makes of it at an amplitude [deg/h], shape (m,)."""
        assert isinstance(declared, LoopEffect)
        inputs = _meeting(self.by_sample.inputs(self.even, None), constants)
        output = np.asarray(inputs.output)
        return self.of(self.by_sample.means(declared.apply(output, inputs, amplitude) - output))

    def delayed(self, delay_s: float, constants: Mapping[str, float]) -> FloatArray:
        """What a delay of the output [s] makes of it [deg/h], shape (m,)."""
        inputs = _meeting(self.by_sample.inputs(self.even, None), constants)
        output = np.asarray(inputs.output)
        late = np.interp(inputs.time - delay_s, inputs.time, output)
        return self.of(self.by_sample.means(late - output))


@dataclass(frozen=True, eq=False)
class _BySample:
    """Samples of a run, and the even row that each is in."""

    recorded: Inputs
    row: NDArray[np.intp]
    used: NDArray[np.bool_]
    counts: FloatArray

    def means(self, values: FloatArray) -> FloatArray:
        """Means of a series over even rows, shape (n,) to (e,); interpolated where there is no sample."""
        total = np.bincount(self.row[self.used], weights=values[self.used], minlength=len(self.counts))
        held = self.counts > 0
        means = np.divide(total, self.counts, out=np.zeros(len(total)), where=held)
        at = np.arange(len(total))
        return means if held.all() else np.where(held, means, np.interp(at, at[held], means[held]))

    def inputs(self, even: Inputs, temperatures: Mapping[str, FloatArray] | None) -> Inputs:
        """Inputs at the samples, with the even rows' temperatures."""
        held = {**even.temperatures, **(temperatures or {})}
        time = self.recorded.time
        smooth = {name: np.interp(time, even.time, values) for name, values in held.items()}
        return replace(self.recorded.afresh(), temperatures=smooth, sensors={}, cache={}, coil=even.coil)


def rows_of(run: Run, twin: Twin, priors: Priors) -> Rows:
    """A run brought to rows.

    Raises
    ------
    Unusable
        If it holds no temperature, or hardly a sample that can be used.
    """
    run = run.without_dropouts
    if not run.temperature_columns:
        raise Unusable(f"{run.name}: holds no temperature; a replay needs 'T [degC]' or 'T_in [degC]'")
    usable, masked = _usable(run)
    if usable.sum() < FEWEST_ROWS:
        raise Unusable(
            f"{run.name}: {int(usable.sum())} rows have a number in every column; a diagnosis needs more"
        )
    step = float(np.median(np.diff(run.time)))
    width = max(1, -(-round(run.span_s / step + 1.0) // priors.most_rows))
    row_s = width * step
    row = np.floor((run.time - run.time[0] + 0.5 * step) / row_s).astype(np.intp)
    count = int(row[-1]) + 1
    replayer = Replayer(run)
    counts = np.bincount(row[usable], minlength=count).astype(np.float64)
    samples = _BySample(replace(replayer.recorded, coil=twin.coil), row, usable, counts)
    time = run.time[0] + row_s * np.arange(count) + 0.5 * (width - 1) * step
    even, readings, noise = _even(samples, time, twin, replayer, row_s)
    replayed = replayer.with_temperatures(
        {name: np.interp(run.time, time, even.temperatures[name]) for name in readings}
    ).output(twin)
    kept = counts >= LEAST_FULL * width
    kept &= time - row_s >= run.time[0] + min(2.0 * DELTA_WINDOW_S, 0.1 * run.span_s) - step
    kept &= ~_after_gaps(run, time, row_s)
    if kept.sum() < FEWEST_ROWS:
        raise Unusable(f"{run.name}: its stretches between gaps are too short for a replay")
    columns = _constant_columns(samples, even)
    return Rows(
        run=run,
        gap=samples.means(run.gyro_deg_h - replayed)[kept],
        recorded=samples.means(run.error_deg_h)[kept],
        end_s=(time + 0.5 * (row_s))[kept],
        row_s=row_s,
        weight=np.sqrt(np.minimum(counts / width, 1.0))[kept],
        constants=columns[kept],
        even=even,
        kept=kept,
        readings=readings,
        reading_noise=noise,
        by_sample=samples,
        masked=masked,
    )


def _usable(run: Run) -> tuple[NDArray[np.bool_], dict[str, int]]:
    usable = np.ones(len(run), dtype=np.bool_)
    for values in run.columns.values():
        usable &= np.isfinite(values)
    masked = {"no number": int((~usable).sum())}
    gyro = np.where(np.isfinite(run.gyro), run.gyro, 0.0)
    outliers, _ = find_outliers(gyro, run.columns.get("rate"))
    masked["outliers"] = len(outliers)
    usable[outliers] = False
    if not np.any(run.rate):
        for extreme in (gyro.max(), gyro.min()):
            at = np.concatenate([[0], (gyro == extreme).astype(np.int8), [0]])
            edges = np.flatnonzero(np.diff(at))
            for first, last in zip(edges[::2], edges[1::2]):
                if last - first >= SATURATED and np.ptp(gyro) > 0.0 and len(np.unique(gyro)) > 50:
                    usable[first:last] = False
                    masked["saturated"] = masked.get("saturated", 0) + int(last - first)
    return usable, {why: n for why, n in masked.items() if n}


def _after_gaps(run: Run, time: FloatArray, row_s: float) -> NDArray[np.bool_]:
    """Even rows into which the nominal's memory reaches from over a long gap."""
    hidden = np.zeros(len(time), dtype=np.bool_)
    memory = 2.0 * DELTA_WINDOW_S
    jumps = np.flatnonzero(np.diff(run.time) > max(SHORT_GAP * memory, 3.0 * run.sample_s))
    for i in jumps.tolist():
        hidden |= (time + 0.5 * row_s > run.time[i]) & (time - row_s < run.time[i + 1] + memory)
    return hidden


def _even(
    samples: _BySample, time: FloatArray, twin: Twin, replayer: Replayer, row_s: float
) -> tuple[Inputs, dict[str, FloatArray], dict[str, float]]:
    recorded = samples.recorded
    at = samples.means(recorded.time)
    readings, smooth, noise = {}, {}, {}
    for name, values in recorded.temperatures.items():
        means = np.interp(time, at, samples.means(values))
        readings[name] = means
        smooth[name], noise[name] = smoothed(means)
    drives = {name: samples.means(values) for name, values in recorded.drives.items()}
    if "angle" in drives:
        drives["angle"] = np.interp(time, recorded.time, recorded.drives["angle"])
    even = replace(
        recorded,
        time=time,
        temperatures=smooth,
        sensors={},
        table_rate=samples.means(recorded.table_rate),
        drives=drives,
        rate_window_s=0.0,
        hindsight=True,
        cache={},
    )
    nodes = estimate_nodes(
        twin.network,
        time,
        smooth,
        powered=replayer.windows,
        fan=drives.get("fan"),
        table_rate=even.table_rate,
    )
    even = replace(even, temperatures={**nodes, **smooth}, cache={})
    return even, readings, noise


def _constant_columns(samples: _BySample, even: Inputs) -> FloatArray:
    """Response to each nominal constant on the even rows, shape (e, 8); 0 where a run can't show one."""
    by_sample = samples.inputs(even, None)
    told = dict(nominal_columns(even))
    if np.any(even.table_rate) or "angle" in even.drives:
        fast = nominal_columns(by_sample)
        told |= {name: samples.means(fast[name]) for name in ("e0", "k1", "k2")}
    told["m"] = window_difference(even.time, even.temperature("T"), DELTA_WINDOW_S)
    return np.column_stack([told.get(name, np.zeros(len(even.time))) for name in NAMES])


def slopes(rows: Rows, constants: Mapping[str, float]) -> dict[str, FloatArray]:
    """Change of the nominal output with each temperature and with DeltaT, on the even rows."""
    from fogml.twin.nominal import NominalConstants, temperature_slopes

    return temperature_slopes(rows.even.afresh(), NominalConstants(**dict(constants)))


def through_nominal(
    rows: Rows, told: Mapping[str, FloatArray], errors: Mapping[str, FloatArray]
) -> FloatArray:
    """What errors of temperatures [degC] on the even rows make of the replay, given slopes; shape (m,)."""
    total = np.zeros(len(rows.kept))
    for name, slope in told.items():
        if name == DELTA:
            error = errors.get("T", errors.get("T_in"))
            if error is not None:
                total = total + slope * window_difference(rows.even.time, error, DELTA_WINDOW_S)
            continue
        error = errors.get(name) if name in errors else errors.get({"T": "T_in", "T_in": "T"}.get(name, name))
        if error is not None:
            total = total + slope * error
    return rows.of(total)


def _meeting(inputs: Inputs, constants: Mapping[str, float] | None) -> Inputs:
    """Inputs with the output and the slopes of the nominal gyro at constants."""
    if constants is None:
        return inputs
    from fogml.twin.nominal import NominalConstants, bias_deg_h, scale_factor_ppm, temperature_slopes

    nominal = NominalConstants(**dict(constants))
    rate = inputs.input_rate_deg_h
    output = (1.0 + 1e-6 * scale_factor_ppm(inputs, nominal)) * rate + bias_deg_h(inputs, nominal)
    return replace(inputs, output=np.asarray(output), slopes=temperature_slopes(inputs, nominal))
