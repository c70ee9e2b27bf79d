"""A recording brought to rows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.errors import InputError
from fogml.gap.model import GyroModel
from fogml.gap.own_simulator import OwnOnRun
from fogml.gap.rows import BySample, Rows
from fogml.gap.settings import STANDARD
from fogml.gap.step_settings import RowSettings
from fogml.runs.checks import rests, usual_rest
from fogml.runs.outliers import find_outliers
from fogml.runs.run import Run
from fogml.runs.turning import turning
from fogml.signals.clock import gap_starts
from fogml.signals.smoothing import Smoothness, at_points, smoothed, window_difference
from fogml.twin.inputs import Inputs
from fogml.twin.nominal import DELTA_WINDOW_S, NAMES, nominal_columns
from fogml.twin.plant.estimate import estimate_nodes
from fogml.twin.replay import Replayer
from fogml.twin.twin import Twin


class Unusable(InputError):
    """A run that a diagnosis can't use; others may do."""


def rows_of(
    run: Run,
    twin: Twin,
    most: int,
    model: GyroModel | None = None,
    settings: RowSettings = STANDARD.rows,
    *,
    exact: bool = False,
    since_s: float = -math.inf,
) -> Rows:
    """A run brought to `most` rows at most, replayed by the twin, or by another model in its place.

    Of `exact` readings there is nothing to be smoothed. What comes before `since_s` on the run's clock is
    past that the rest remembers, and no row.

    Raises
    ------
    Unusable
        If it holds no temperature, or hardly a sample that can be used.
    """
    run = run.without_dropouts
    if not run.temperature_columns:
        raise Unusable(f"{run.name}: holds no temperature; a replay needs 'T [degC]' or 'T_in [degC]'")
    usable, left_out = usable_samples(run, settings)
    if usable.sum() < settings.fewest:
        empty = [name for name, values in run.columns.items() if not np.isfinite(values).any()]
        if empty:
            raise Unusable(f"{run.name}: column '{empty[0]}' holds no number; fill it or leave it out")
        raise Unusable(f"{run.name}: {int(usable.sum())} samples can be used; a diagnosis needs more")
    step = float(np.median(np.diff(run.time)))
    width = max(1, -(-round(run.span_s / step + 1.0) // most))
    row_s = width * step
    row = np.floor((run.time - run.time[0] + 0.5 * step) / row_s).astype(np.intp)
    count = int(row[-1]) + 1
    replayer = Replayer(run)
    counts = np.bincount(row[usable], minlength=count).astype(np.float64)
    spread = (row_s**2 - step**2) / 12.0
    given = replace(replayer.recorded, coil=twin.coil, light=twin.light, whole_windows=True)
    if not turning(run).any():
        # Noise of a recorded rate turns nothing: no cause follows it.
        given = replace(given, table_rate=np.zeros(len(run)))
    samples = BySample(given, row, usable, counts, spread)
    time = run.time[0] + row_s * np.arange(count) + 0.5 * (width - 1) * step
    even, readings, noise = _even(samples, time, twin, replayer, exact)
    smooth = at_points(time, {name: even.temperatures[name] for name in readings}, run.time, spread)
    own = None
    if model is not None:
        recorded = {n: v for n, v in smooth.items() if n in run.columns}
        own = OwnOnRun(model, run.with_columns(**recorded), settings.slope_step_degc)
        replayed = own.output({c.name: c.mean for c in model.constants})
        errors = np.zeros((len(time), 2))
        told = own.columns()
        columns = np.array([samples.means(c) for c in told.T]).reshape(told.shape[1], len(time)).T
    else:
        replayed = replayer.with_temperatures(smooth).output(twin)
        errors = _replay_errors(run, twin, replayer, even, readings, samples, replayed, settings.rougher)
        columns = _constant_columns(samples, even, step)
    memory_s = 2.0 * DELTA_WINDOW_S if model is None else model.memory_s
    since_s = max(since_s, float(run.time[0]))
    kept = (counts >= settings.least_full * width) & (time - 0.5 * row_s >= since_s - step)
    kept &= time - row_s >= run.time[0] + min(memory_s, 0.1 * run.span_s) - step
    kept &= ~_after_gaps(run, time, row_s, memory_s, settings.short_gap)
    if kept.sum() < settings.fewest:
        raise Unusable(
            f"{run.name}: {int(kept.sum())} rows lie long enough after its start and gaps for a replay; a "
            f"diagnosis needs {settings.fewest}"
        )
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
        smoothness=noise,
        by_sample=samples,
        replay_errors=errors[kept],
        own=own,
        since_s=since_s,
        masked={why: n for why, at in left_out.items() if (n := int(np.sum(at[run.time >= since_s])))},
    )


def _replay_errors(
    run: Run,
    twin: Twin,
    replayer: Replayer,
    even: Inputs,
    readings: Mapping[str, FloatArray],
    samples: BySample,
    replayed: FloatArray,
    share: float,
) -> FloatArray:
    """What errors of the readings make of the twin's own effects, shape (e, 2) [deg/h].

    Readings that are late by 1 s; and readings as they were, of which smoothing takes away noise and some
    of what is true: smoothed by a share of the penalty.
    """
    if not twin.on:
        return np.zeros((len(even.time), 2))
    columns = []
    late = {n: even.temperatures[n] + np.gradient(even.temperatures[n], even.time) for n in readings}
    rougher = {n: smoothed(values, share)[0] for n, values in readings.items()}
    for moved in (late, rougher):
        other = replayer.with_temperatures(at_points(even.time, moved, run.time, samples.spread))
        columns.append(samples.means(other.output(twin) - replayed))
    return np.column_stack(columns)


def usable_samples(run: Run, settings: RowSettings = STANDARD.rows) -> tuple[BoolArray, dict[str, BoolArray]]:
    """Samples that are no outlier, nor at a limit of the output, shape (n,); those left out, by why."""
    usable = np.ones(len(run), dtype=np.bool_)
    for values in run.columns.values():
        usable &= np.isfinite(values)
    none = np.zeros(len(run), dtype=np.bool_)
    left_out = {"no number": ~usable, "outliers": none.copy(), "saturated": none}
    gyro = np.where(np.isfinite(run.gyro), run.gyro, 0.0)
    outliers, _ = find_outliers(gyro, run.columns.get("rate"))
    left_out["outliers"][outliers] = True
    usable[outliers] = False
    if not turning(run).any():
        held = gyro[usable]
        varied = np.ptp(gyro) > 0.0 and len(np.unique(gyro)) > settings.distinct
        for extreme in (held.max(), held.min()) if len(held) else ():
            at = np.concatenate([[0], (gyro == extreme).astype(np.int8), [0]])
            spells = np.flatnonzero(np.diff(at)).reshape(-1, 2)
            lengths = np.diff(spells)[:, 0]
            longest = int(lengths.max())
            if varied and longest >= settings.saturated and not rests(longest, usual_rest(held)):
                for first, last in spells[lengths >= settings.saturated].tolist():
                    left_out["saturated"][first:last] = True
    return usable & ~left_out["saturated"], left_out


def _after_gaps(run: Run, time: FloatArray, row_s: float, memory: float, short: float) -> BoolArray:
    """Even rows into which the model's memory [s] reaches from over a long gap."""
    hidden = np.zeros(len(time), dtype=np.bool_)
    for i in gap_starts(run.time, run.sample_s, short * memory).tolist():
        hidden |= (time + 0.5 * row_s > run.time[i - 1]) & (time - row_s < run.time[i] + memory)
    return hidden


def _even(
    samples: BySample, time: FloatArray, twin: Twin, replayer: Replayer, exact: bool
) -> tuple[Inputs, dict[str, FloatArray], dict[str, Smoothness]]:
    recorded = samples.recorded
    at = samples.means(recorded.time)
    readings, smooth, noise = {}, {}, dict[str, Smoothness]()
    for name, values in recorded.temperatures.items():
        means = np.interp(time, at, samples.means(values))
        readings[name] = means
        smooth[name], noise[name] = (means, Smoothness(0.0, 0.0)) if exact else smoothed(means)
    drives = {name: samples.means(values) for name, values in recorded.drives.items()}
    if "angle" in drives:
        angle = recorded.drives["angle"]
        angle = np.unwrap(angle, period=360.0) if recorded.angle_begins_anew else angle
        drives["angle"] = np.interp(time, recorded.time, angle)
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
        table_rate=samples.means(np.abs(recorded.afresh().turning_deg_s)),
    )
    even = replace(even, temperatures={**nodes, **smooth}, cache={})
    return even, readings, noise


def _constant_columns(samples: BySample, even: Inputs, sample_s: float) -> FloatArray:
    """Response to each nominal constant on the even rows, shape (e, 8); 0 where a run can't show one."""
    told = dict(nominal_columns(even))
    if np.any(even.table_rate):
        fast = nominal_columns(samples.inputs(even, None))
        told |= {name: samples.means(fast[name]) for name in ("e0", "k1", "k2")}
    told["m"] = window_difference(even.time, even.temperature("T"), DELTA_WINDOW_S, 0.5 * sample_s)
    return np.column_stack([told.get(name, np.zeros(len(even.time))) for name in NAMES])
