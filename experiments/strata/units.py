"""Simulated units with one kind of effect each, or all of them, and programmes of one to three cycles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

import fogml.twin
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.twin.simulate import Simulation, simulate
from fogml.twin.twin_file import load_twin

STRATA = ("static", "rates", "hysteresis", "tails", "warm-up", "all")
SAMPLE_S = 5.0
AVERAGING_S = 100.0
COLUMNS = ("T_in", "T_out", "T_electronics", "T_chamber", "power")
TACTICAL = Path(fogml.twin.__file__).parent / "twins" / "tactical.yaml"


def steps(cycles: int, rates: list[float], low: float, high: float, soak_min: int) -> dict[str, Any]:
    """Cycles between two temperatures [degC] at rates [degC/min] in turn, with soaks at both."""
    parts: list[Any] = [{"soak at 25 degC for 30 min": ["power on"]}]
    for cycle in range(cycles):
        rate = rates[cycle % len(rates)]
        for end in (high, low):
            parts += [f"ramp to {end} degC at {rate} degC/min", f"soak at {end} degC for {soak_min} min"]
    parts += [f"ramp to 25 degC at {rates[-1]} degC/min", "soak at 25 degC for 30 min"]
    frame = {"schema": "fogml.programme/1", "name": "cycles", "description": f"{cycles} cycles"}
    return {**frame, "start_temperature": "25 degC", "power": "off", "steps": parts}


def unit(stratum: str, seed: int) -> tuple[dict[str, Any], float]:
    """A twin drawn from a seed, and the rate of its test run [degC/min]."""
    rng = np.random.default_rng([seed, STRATA.index(stratum), 41])

    def size(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    def signed(low: float, high: float, of: str) -> dict[str, Any]:
        return {"value": size(low, high) * float(rng.choice([-1.0, 1.0])), "unit": of}

    twin = yaml.safe_load(TACTICAL.read_text(encoding="utf-8"))
    for name, ends in {"b1": (5e-3, 3e-2), "b2": (3e-5, 3e-4), "g": (0.05, 0.4), "m": (0.2, 1.2)}.items():
        twin["nominal"][name]["value"] = signed(*ends, "")["value"]
    product, lag = "deg/h/degC/(degC/min)", "deg/h/degC"
    kinds: dict[str, dict[str, dict[str, Any]]] = {
        "static": {"bias_polynomial": {"amplitude": signed(0.1, 0.5, "deg/h")}},
        "rates": {
            "temperature_rate_product": {"amplitude": signed(3e-3, 2e-2, product)},
            "shupe_pure": {"amplitude": signed(0.3, 3.0, "deg/h/(degC/min)")},
        },
        "hysteresis": {
            "thermal_hysteresis": {
                "amplitude": signed(0.1, 0.5, "deg/h"),
                "half_width": {"value": size(3.0, 20.0), "unit": "degC"},
            }
        },
        "tails": {
            "hidden_thermal_node": {
                "amplitude": signed(0.01, 0.08, lag),
                "time_constant": {"value": size(1200.0, 3600.0), "unit": "s"},
            }
        },
        "warm-up": {
            "warmup_bias": {
                "amplitude": signed(0.3, 3.0, "deg/h"),
                "slow_time_constant": {"value": size(600.0, 2400.0), "unit": "s"},
            }
        },
    }
    taken = kinds.values() if stratum == "all" else [kinds[stratum]]
    twin["effects"] = {name: shape for kind in taken for name, shape in kind.items()}
    twin["name"] = f"{stratum}-{seed}"
    return twin, float(rng.choice([0.7, 1.5]))


def case(stratum: str, cycles: int, seed: int) -> tuple[Simulation, Simulation]:
    """A training run of some cycles and a test run at another rate and range."""
    values, rate = unit(stratum, seed)
    twin = load_twin(values)
    rates = [1.0, 0.5, 2.0] if cycles > 1 else [1.0]
    programmes = (steps(cycles, rates, -40.0, 60.0, 60), steps(1, [rate], -35.0, 55.0, 90))
    first, second = (
        simulate(programme, twin, sample_s=SAMPLE_S, seed=10 * seed + k, truth=True, columns=COLUMNS)
        for k, programme in enumerate(programmes)
    )
    return first, second


def recorded(simulation: Simulation) -> Run:
    """What the drift models see: the output, both faces of the coil, and the time of power-on."""
    run = simulation.run
    columns = {name: run.columns[name] for name in ("time", "gyro", "T_in", "T_out")}
    return Run(run.name, columns, Facts(powered_on=run.facts.powered_on))


def oracle(train: Simulation, test: Simulation) -> float:
    """Rms left on the test run by least squares of the true effects and the nominal terms [deg/h]."""
    X, y = _columns(train)
    Z, z = _columns(test)
    scale = np.maximum(np.abs(X).max(axis=0), 1e-12)
    used = np.abs(X).max(axis=0) > 1e-9
    coef, *_ = np.linalg.lstsq(X[:, used] / scale[used], y, rcond=None)
    return float(np.sqrt(np.mean((z - Z[:, used] / scale[used] @ coef) ** 2)))


def _columns(simulation: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Averages of the true effects and the nominal terms, and of the output."""
    run, truth = simulation.run, simulation.truth
    assert truth is not None
    T, gradient = run.columns["T_in"], run.columns["T_in"] - run.columns["T_out"]
    effects = [values for name, values in sorted(truth.contributions.items()) if name != "nominal"]
    smooth = np.convolve(np.pad(T, (25, 24), mode="edge"), np.full(50, 1.0 / 50.0), "valid")
    rate = np.gradient(smooth) * 60.0 / SAMPLE_S
    X = np.column_stack([np.ones(len(T)), T, T**2, gradient, rate, *effects])
    width = round(AVERAGING_S / SAMPLE_S)
    count = len(T) // width * width
    averaged = X[:count].reshape(-1, width, X.shape[1]).mean(axis=1)
    return averaged, run.gyro_deg_h[:count].reshape(-1, width).mean(axis=1)
