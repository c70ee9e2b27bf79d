"""Runs of a north seek in several positions, simulated."""

from __future__ import annotations

import numpy as np

from fogml.errors import InputError
from fogml.lab.north import Drift, Scheme, horizontal_rate
from fogml.runs.facts import Facts
from fogml.runs.run import Run


def simulated_positions(
    scheme: Scheme,
    azimuth_deg: float,
    latitude_deg: float,
    drift: Drift,
    *,
    bias_deg_h: float = 0.0,
    random_walk_deg_sqrt_h: float = 0.0,
    sample_s: float = 1.0,
    seed: int = 0,
) -> Run:
    """A synthetic run of a scheme with a column ``position``, each sample the mean over its interval.

    Samples that are not wholly in a position have position 0; the axis is not simulated on the way.

    Raises
    ------
    InputError
        If a stay is shorter than a sample, or the latitude is not accepted.
    """
    if not (np.isfinite(sample_s) and 0.0 < sample_s <= scheme.dwell_s):
        raise InputError(f"sample interval {sample_s:g} s: above 0 and no longer than the dwell is needed")
    begin, end = scheme.spans_s
    count = int(np.ceil((end[-1] - begin[0]) / sample_s - 1e-9))
    start = begin[0] + sample_s * np.arange(count)
    stay = np.searchsorted(begin, start + 1e-9, side="right") - 1
    inside = start + sample_s <= end[stay] + 1e-9
    order = list(dict.fromkeys(scheme.order_deg))
    numbers = np.array([order.index(angle) + 1 for angle in scheme.order_deg], dtype=np.float64)
    outputs = scheme.outputs(azimuth_deg, horizontal_rate(latitude_deg))[stay]
    gyro = np.where(inside, outputs, 0.0) + bias_deg_h + drift.mean(start, start + sample_s)
    noise = random_walk_deg_sqrt_h / np.sqrt(sample_s / 3600.0)
    gyro += noise * np.random.default_rng(seed).standard_normal(count)
    facts = Facts(
        unit="synthetic", latitude=latitude_deg, powered_on=0.0, notes="synthetic: simulated positions"
    )
    columns = {"time": start, "gyro": gyro, "position": np.where(inside, numbers[stay], 0.0)}
    return Run("synthetic positions", columns, facts)
