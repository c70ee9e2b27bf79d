"""A unit that is off gives no output, but its winding, sensors and plant go on with the temperature."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fogml.twin.effect import NoiseEffect
from fogml.twin.plant.heat import SelfHeating
from fogml.twin.registry import effects
from fogml.twin.replay import replay
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.simulate import Simulation, simulate
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin

BY_POWER = ("self_heating", "turn_on_bias", "warmup_bias", "halfwave_voltage", "fringe_jump")
LOGGED = ("output_counts", "logger_skew", "averaging")
"""Where the output counts, of which there is none."""


def programme(*off: str) -> dict[str, Any]:
    """Up by 20 degC, a dose, and back, at rates at which a winding slips where its threshold is low."""
    steps = [
        "soak at 25 degC for 5 min",
        {"ramp to 45 degC at 5 degC/min": list(off)},
        {"hold for 15 min": ["radiation at 5 Gy/h for 5 min from minute 5"]},
        "ramp to 25 degC at 5 degC/min",
        {"hold for 40 min": ["power on at minute 2", "turn at 5 deg/s for 60 s from minute 5"]},
    ]
    return {"power": "on", "steps": steps}


def cold(twin: Twin) -> Twin:
    """A twin that makes no heat and no noise."""
    quiet = dict.fromkeys("QNBKR", 0.0)
    return replace(twin, plant=replace(twin.plant, heating=SelfHeating())).with_noise(**quiet)


def both(twin: Twin, **more: Any) -> tuple[Simulation, Simulation, np.ndarray]:
    """On throughout, off from the first ramp to the end of the second, and rows of the one that both have."""
    on, off = (
        simulate(programme(*power), twin, truth=True, **more) for power in ((), ("power off at minute 1",))
    )
    assert len(off.run) < len(on.run) - 1400
    return on, off, np.searchsorted(on.run.time, off.run.time)


@pytest.mark.parametrize(
    "id",
    [
        id
        for id, declared in effects().items()
        if id not in (*BY_POWER, *LOGGED) and (not isinstance(declared, NoiseEffect) or declared.steady)
    ],
)
def test_what_does_not_follow_power_goes_on_without_it(id: str) -> None:
    shape = {"threshold": 0.5} if id == "thermal_shock" else {}
    twin = cold(replace(load_twin("tactical"), settings={})).with_effect(id, **shape)
    on, off, rows = both(twin)
    wanted = on.truth.contributions[id]
    size = max(np.abs(wanted).max(), 1e-9)
    np.testing.assert_allclose(off.truth.contributions[id], wanted[rows], atol=1e-6 * size)


def test_noise_by_the_dose_and_lagging_sensors_go_on_too() -> None:
    twin = cold(Twin(sensors=Sensors(SensorErrors(lag=60.0)))).with_effect("radiation_noise")
    on, off, rows = both(twin, seed=4)
    assert np.abs(off.truth.noise).max() > 0.0
    np.testing.assert_allclose(off.truth.noise, on.truth.noise[rows], rtol=1e-9)
    for name in ("T_in", "T_case"):
        np.testing.assert_allclose(off.run.columns[name], on.run.columns[name][rows], atol=1e-9)


def test_a_power_cycle_while_nothing_moves_replays_to_rounding() -> None:
    """What moves while it is off is in no row: a replay takes a straight line for it."""
    twin = cold(Twin())
    for id, declared in effects().items():
        random = isinstance(declared, NoiseEffect) or declared.seeded
        moving = id in ("chamber_ripple", "self_heating", "fringe_jump", "units_and_gaps", "loop_gain")
        if not (random or moving or declared.conflicts):
            twin = twin.with_effect(id)
    cycle = ["turn at 5 deg/s for 60 s from minute 2", "power off for 3 min from minute 10"]
    made = simulate([{"soak at 25 degC for 30 min": cycle}], twin, sample_s=5.0, truth=True)
    assert replay(twin, made.run, truth=made.truth) == pytest.approx(made.truth.noise_free, abs=1e-8)
