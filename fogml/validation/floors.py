"""The noise floor of a run at an averaging time, what no model takes away; which design index it allows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IntArray
from fogml.errors import InputError
from fogml.intervals import LEVEL
from fogml.numerals import against, percent, short, stated
from fogml.runs.noise_of_run import moving_temperatures
from fogml.runs.noise_series import rows_at_rest, sample_interval
from fogml.runs.run import Run
from fogml.runs.thermometers import thermal_columns
from fogml.signals import large
from fogml.signals.clock import gap_starts, longest_gap_s
from fogml.signals.distributions import chi2_ppf
from fogml.signals.floor import Columns, Floor, FloorModel, floor_model
from fogml.validation.results import RunJudgement

_KEPT = "_floor_models"


def floor_of_run(
    run: Run, used: BoolArray, error_deg_h: FloatArray, averaging_s: float, noise: Run | None = None
) -> Floor:
    """Noise left in averages over `averaging_s` [deg/h], as `fogml.signals.floor` defines it.

    From a static run where one is given; else from the run's own error, what follows the
    temperature, its powers and its lags being kept out, and what rises like a random walk too where a
    temperature moves. Stretches cross neither gaps nor rows that don't count.

    Parameters
    ----------
    used
        Rows that count, shape (n,).
    error_deg_h
        Error of the whole run before a model [deg/h], shape (n,).
    noise
        A static run of the unit.
    """
    windows = max(int(np.count_nonzero(used) * _interval_s(run, averaging_s) / averaging_s), 2)
    if noise is not None:
        still = rows_at_rest(noise)
        found = _model(noise, still, noise.error_deg_h, averaging_s, static=True)
        source = f"static run {noise.name}"
    else:
        found = _model(run, used, error_deg_h, averaging_s)
        source = "the run itself"
    return Floor(0.0, 0.0, 0.0, source) if found is None else found.floor(averaging_s, windows, source)


def floors_over(run: Run, averaging_s: float, times_s: Sequence[float]) -> list[Floor]:
    """Floors of a run over averaging times [s] none of which is under `averaging_s`, for a curve of them.

    The noise models are those of `floor_of_run` at `averaging_s`. None where the run is shorter than two
    averages, or turns throughout.
    """
    still = rows_at_rest(run)
    recorded_s = np.count_nonzero(still) * _interval_s(run, averaging_s)
    if recorded_s < 2.0 * averaging_s:
        return []
    found = _model(run, still, run.error_deg_h, averaging_s)
    if found is None:
        return []
    return [found.floor(time_s, max(int(recorded_s / time_s), 2)) for time_s in times_s]


def _model(
    run: Run, used: BoolArray, error_deg_h: FloatArray, averaging_s: float, *, static: bool = False
) -> FloorModel | None:
    """Noise models of a run's error, found once for each averaging time and choice of rows."""
    kept = run.__dict__.setdefault(_KEPT, {})
    key = (averaging_s, static, used.tobytes().__hash__())
    if key not in kept:
        rows = large.places(used)
        broken = np.concatenate([at + 1 + np.flatnonzero(step > 1) for at, step in large.differences(rows)])
        gaps = np.searchsorted(rows, run.gap_starts)
        edges = np.union1d(np.concatenate(([0], broken, gaps)), [len(rows)])
        segments = np.array(list(pairwise(edges.tolist())), dtype=np.int64).reshape(-1, 2)
        long = segments[:, 1] - segments[:, 0] >= 3
        if not np.any(long):
            raise InputError(
                f"{run.name}: no three samples in a row count, as those at which the table turns or "
                "a thermometer fails do not; a noise floor needs more: give a run that rests longer"
            )
        starts, stops = segments[long].T
        moves = bool(moving_temperatures(run))
        large.release()
        columns = _at_rows(run, rows) if moves else None
        # Without a temperature nobody knows whether a slow change is the gyro's own.
        drifts = moves or (not static and not run.temperature_columns)
        kept[key] = floor_model(
            large.chosen(error_deg_h, used),
            _interval_s(run, averaging_s),
            averaging_s,
            starts,
            stops,
            columns,
            drifts=drifts,
        )
    found: FloorModel | None = kept[key]
    return found


def _interval_s(run: Run, averaging_s: float) -> float:
    """Time that a sample stands for [s] in averages, which hold fewer of them where some are lost."""
    cuts = gap_starts(run.time, run.sample_s, longest_gap_s(averaging_s, run.sample_s))
    return sample_interval(run, [slice(a, b) for a, b in pairwise([0, *cuts.tolist(), len(run)])])


def _at_rows(run: Run, rows: IntArray) -> Columns:
    """What a drift may follow, by places among rows."""
    follows = thermal_columns(run)
    return lambda places: follows(run.time[rows[places]])


def floor_interval(floor: float, averages: int, level: float = LEVEL) -> tuple[float, float]:
    """Interval in which the rms of so many averages of noise alone lies [deg/h].

    Parameters
    ----------
    floor
        Standard deviation of the noise in one average [deg/h].
    averages
        How many there are, taken as independent (chi-squared).
    level
        Share of the cases in it.
    """
    tails = chi2_ppf([0.5 * (1.0 - level), 0.5 * (1.0 + level)], max(averages, 1))
    low, high = floor * np.sqrt(tails / max(averages, 1))
    return float(low), float(high)


def most_noise(judged: RunJudgement, averages: int) -> float:
    """Largest rms of so many averages of a run that is noise alone, as far as it tells [deg/h].

    The upper end of the interval for noise alone, of the upper end of the floor's.
    """
    upper = judged.floor if judged.floor_ci90 is None else judged.floor_ci90[1]
    return floor_interval(upper, averages)[1]


def made_worse(judged: RunJudgement, before: float, after: float) -> bool:
    """Whether a figure of what is left on a run has risen by more than the run's noise hides.

    More is left than noise alone leaves, and what came in addition, by squares as drift and noise add up,
    is no less than the noise floor: as much as has to be taken away before a model is said to take any.

    Parameters
    ----------
    judged
        The run.
    before, after
        Rms or bias stability of the averages without and with the model [deg/h].
    """
    return after**2 - before**2 > judged.floor**2 and after > most_noise(judged, len(judged.series.time))


def left_is_noise(judged: RunJudgement) -> bool:
    """Whether what is left after a model is the gyro's own noise, as far as the averages can tell.

    Their standard deviation is at most `most_noise`; an output that stands still tells nothing of it.
    """
    if judged.still is not None:
        return False
    return judged.after.bias_stability <= most_noise(judged, len(judged.series.time) - 1)


def out_of_reach(
    index: float, floors: Sequence[Floor], averages: Sequence[int], averaging_s: float, where: str
) -> str | None:
    """The sentence that no model can meet a design index on some runs; None where one may.

    It is that of the least noise that floors and so many averages allow.

    Parameters
    ----------
    index
        Greatest rms of averages allowed [deg/h].
    floors, averages
        Noise floor of each run [deg/h], and its number of averages.
    averaging_s
        Averaging time [s].
    where
        Names the runs.
    """
    count = int(np.sum(averages))
    if not count:
        return None
    ends = np.square([(one.lower, one.value, one.upper) for one in floors])
    least, floor, most = np.sqrt(np.average(ends, axis=0, weights=averages))
    low, high = floor_interval(least, count)[0], floor_interval(most, count)[1]
    if index >= low:
        return None
    return (
        f"No model can reach the design index of {stated(index)} deg/h: the noise alone leaves "
        f"{against(floor, index)} deg/h rms ({against(low, index)} to {short(high)}, {percent(LEVEL, 0)}) in "
        f"{count} averages over {averaging_s:g} s of {where}"
    )


def settling_warning(
    run: Run, *, rows: int = 480, constants: int = 8, shows: float = 4.5
) -> dict[str, str] | None:
    """A warning where an exponential from the begin shows beside a line and the run's own noise.

    Parameters
    ----------
    run
        Static.
    rows
        That it is averaged to.
    constants
        Time constants tried, from a 64th to an eighth of the run: longer ones are a random walk's as well.
    shows
        Standard errors from which one is told; the best of those tried passes it by chance in less than one
        run of 100 (simulated: 4 of 1140).
    """
    from fogml.models.generalised_least_squares import beside_constants, runs_noise
    from fogml.models.table import RunRows, averaged_table

    if "rate" in run.columns and run.rate.any():
        return None
    try:
        part = RunRows(np.zeros((len(run), 1)), run.error_deg_h, run.time)
    except InputError:
        return None
    averaging_s = max(run.span_s / rows, run.sample_s)
    table = averaged_table([part], lambda atoms: atoms, averaging_s)
    if len(table) < rows // 4:
        return None
    since, span = table.time_s - run.time[0], float(np.ptp(table.time_s))
    line = since / span - 0.5
    taus = np.geomspace(max(4.0 * averaging_s, span / 64.0), span / 8.0, constants)
    courses = np.exp(-since / taus[:, None])
    ones = np.ones(len(table))
    whole = [np.column_stack((ones, line, course)) for course in courses]
    left = [table.y - columns @ np.linalg.lstsq(columns, table.y, rcond=None)[0] for columns in whole]
    best = int(np.argmin([float(off @ off) for off in left]))
    table = replace(table, X=whole[best][:, 1:])
    size = float(np.std(left[best]))
    if not size > 1e-12 * float(np.abs(table.y).max()):
        return None
    found, errors = beside_constants(runs_noise(table, size), table, table.X)
    amplitude, error = float(found[-1]), float(errors[-1])
    if not abs(amplitude) > shows * error:
        return None
    message = (
        f"The output settles at the begin, by {short(abs(amplitude), 2)} deg/h with a time constant near "
        f"{taus[best]:.0f} s: K, R and what long averaging times hold are of that too; leave out the first "
        f"{5.0 * taus[best]:.0f} s for the noise of the settled gyro."
    )
    return {"code": "settling", "message": message}
