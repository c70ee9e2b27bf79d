"""What ``fogml lab misalignment`` tells, as the values of ``misalignment.json``."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from fogml.lab.misalignment import TableMeasurements, decouple
from fogml.lab.misalignment_errors import LEVEL
from fogml.lab.misalignment_methods import compare_methods, relative_error_ppm

SCHEMA = "fogml.misalignment/1"


def misalignment_json(measured: TableMeasurements, cross_tilt: bool | None = None) -> dict[str, Any]:
    """Scale factor and misalignment of a gyro, with the other methods beside, as ``fogml.misalignment/1``.

    Parameters
    ----------
    measured
        What the turns gave.
    cross_tilt
        Whether to fit a constant over the tilts; if None, where the data show one.

    Raises
    ------
    InputError
        As :func:`fogml.lab.misalignment.decouple`.
    """
    found = decouple(measured, cross_tilt)
    per_rate = f"{measured.unit} per deg/s"
    region = found.region
    return {
        "schema": SCHEMA,
        "source": measured.source,
        "synthetic": measured.synthetic,
        "K": found.K,
        "unit": per_rate,
        "delta_x_deg": found.delta_x_deg,
        "delta_y_deg": found.delta_y_deg,
        "delta_deg": found.delta_deg,
        "fixture_error_deg": list(found.fixture_error_deg),
        "se": dict(found.se or {}),
        "dof": found.dof,
        "level": LEVEL,
        "intervals": {name: list(ends) for name, ends in found.intervals.items()},
        "region": None
        if region is None
        else {
            "level": region.level,
            "half_axes_deg": list(region.half_axes_deg),
            "angle_deg": region.angle_deg,
            "outline_deg": region.outline_deg.tolist(),
        },
        "cross_tilt": found.cross_tilt,
        "cross_tilt_deg": found.cross_tilt_deg,
        "slope_noise": {"by_rates": found.rate_noise, "by_tilts": found.tilt_noise, "unit": per_rate},
        "state_angles_deg": list(measured.state_angles_deg),
        "order_p": found.order_p,
        "turns": len(measured.output),
        "rates_deg_s": np.unique(np.round(measured.rate_deg_s, 6)).tolist(),
        "states": [
            {
                "state": fit.state,
                "tilts_deg": fit.tilts_deg.tolist(),
                "slopes": fit.slopes.tolist(),
                "residuals": fit.residuals.tolist(),
                "coefficients": fit.coefficients.tolist(),
            }
            for fit in found.states
        ],
        "methods": [
            {**asdict(method), "K_difference_ppm": relative_error_ppm(method.K, found.K)}
            for method in compare_methods(measured, found.cross_tilt)
        ],
        "notes": list(found.notes),
    }
