"""Whether an output settles at the begin of a run, which a fit of noise takes for random walk and ramp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fogml.errors import InputError
from fogml.models.generalised_least_squares import beside_constants, runs_noise
from fogml.models.table import RunRows, averaged_table
from fogml.numerals import short
from fogml.runs.run import Run


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
