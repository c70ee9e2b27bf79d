"""The noise floor of a run at an averaging time: what no drift model can take away."""

from __future__ import annotations

from fogml.runs.run import BoolArray, FloatArray, Run
from fogml.signals.floor import noise_floor


def floor_of_run(run: Run, used: BoolArray, error_deg_h: FloatArray, averaging_s: float) -> float:
    """Noise left in averages over `averaging_s` [deg/h], from the high-frequency part of an error series.

    Parameters
    ----------
    used
        Rows that count, shape (n,).
    error_deg_h
        Error of the whole run [deg/h], shape (n,).
    """
    return float(noise_floor(error_deg_h[used], run.sample_s, averaging_s))
