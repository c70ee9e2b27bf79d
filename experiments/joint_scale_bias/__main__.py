"""Scale factor and bias from one temperature run: the patent's form, a sounder one, and two-step practice.

Run ``python -m experiments.joint_scale_bias``; it reads ``config.yaml`` and writes ``results.json``,
``results.md``, ``results.html`` and figures beside itself. ``--quick`` prints a small version.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from experiments.joint_scale_bias.page import drawings, page
from experiments.joint_scale_bias.world import (
    PATENT_STEPS,
    Made,
    earth_in_rate,
    known_unit,
    made,
    only_inner,
    patent_staircase,
    second_staircase,
    set_point,
    soak_residuals,
    unit,
    without_facts,
)
from experiments.results import write_results
from fogml import __version__
from fogml.arrays import BoolArray, FloatArray
from fogml.features.parse import parse_features
from fogml.lab.joint import run_figures, two_step
from fogml.models.joint import JointModel
from fogml.runs.run import Run
from fogml.yaml_text import read_yaml

HERE = Path(__file__).parent
Compensate = Callable[[Run], tuple[FloatArray, BoolArray]]


def settings_of(quick: bool) -> dict[str, Any]:
    """The settings, cut down where quick."""
    settings: dict[str, Any] = read_yaml(HERE / "config.yaml")
    if quick:
        settings |= {"seeds": [1], "windows": [6], "resolutions": [0.01], "turning_soaks": [2, 12]}
        settings |= {"bias_hystereses": [0.0], "scale_hystereses": [80.0]}
        settings["quality"] = {**settings["quality"], "windows": [0, 6]}
    return settings


def joint(run: Run, patent: bool = False, window_s: float = 64.0) -> Compensate:
    """A joint model fitted to a run."""
    model = JointModel(patent=patent, rate_window_s=window_s).fit(run)

    def compensate(other: Run) -> tuple[FloatArray, BoolArray]:
        evaluation = model.evaluate(other)
        return other.gyro_deg_h - evaluation.drift, evaluation.full

    return compensate


def known(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Largest residual of a soak [deg/h] and scale factor error [ppm] on the noise-free known unit."""
    run = made(patent_staircase(), known_unit(), settings["latitude"], 0).run
    forms = {
        "six columns, as printed": joint(run, patent=True),
        "six columns, Earth rate in y": joint(earth_in_rate(run), patent=True),
        "intercept, no Earth rate in y": joint(without_facts(run)),
        "intercept and Earth rate in y": joint(run),
    }
    told = {}
    for name, form in forms.items():
        rate, full = form(run)
        temperature, residual = soak_residuals(run, rate)
        scale = run_figures(run, rate, full).scale_factor_error_largest
        told[name] = {
            "temperature": temperature.tolist(),
            "residual": residual.tolist(),
            "largest_residual": float(np.abs(residual).max()),
            "scale_factor_ppm": scale,
        }
    return told


def practices(stairs: Made, rests: Made) -> dict[str, tuple[float, Compensate]]:
    """Each way with the hours in the chamber that it takes."""
    run, hours = stairs.run, stairs.run.span_s / 3600.0
    both = hours + rests.run.span_s / 3600.0
    return {
        "six columns, as printed": (hours, joint(run, patent=True)),
        "six columns, Earth rate in y": (hours, joint(earth_in_rate(run), patent=True)),
        "intercept and Earth rate in y": (hours, joint(run)),
        "two steps, two runs": (both, two_step(run, rests.run).rate),
        "two steps, one run": (hours, two_step(run).rate),
        "two steps, two runs, turns one way": (both, two_step(run, rests.run, one_sense=True).rate),
        "two steps, one run, turns one way": (hours, two_step(run, one_sense=True).rate),
    }


def figures(run: Run, compensate: Compensate, averaging_s: float) -> dict[str, float]:
    """What is left on a run."""
    rate, full = compensate(run)
    left = run_figures(run, rate, full, averaging_s)
    return {
        "rms": left.rms,
        "bias_stability": left.bias_stability,
        "largest_soak": float(np.abs(soak_residuals(run, rate)[1]).max()),
        "scale_factor_ppm": left.scale_factor_error_largest or 0.0,
    }


def compared(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Medians over the seeds of what each practice leaves on its own run and on the second staircase."""
    latitude, averaging = settings["latitude"], settings["averaging"]
    twin = unit(settings)
    found: dict[str, dict[str, list[dict[str, float]]]] = {}
    hours: dict[str, float] = {}
    floors = []
    for seed in settings["seeds"]:
        stairs = made(patent_staircase(), twin, latitude, 10 * seed)
        rests = made(patent_staircase(turning=()), twin, latitude, 10 * seed + 1)
        second = made(second_staircase(settings), twin, latitude, 10 * seed + 2)
        floors.append([stairs.floor(averaging), second.floor(averaging)])
        ways = practices(stairs, rests)
        ways["nothing"] = (0.0, lambda run: (run.gyro_deg_h, np.ones(len(run), dtype=bool)))
        for name, (time_h, way) in ways.items():
            hours[name] = time_h
            told = found.setdefault(name, {"own run": [], "second staircase": []})
            told["own run"].append(figures(stairs.run, way, averaging))
            told["second staircase"].append(figures(second.run, way, averaging))
    own, other = np.median(floors, axis=0).tolist()
    return {
        "hours": hours,
        "floor": {"own run": own, "second staircase": other},
        "ways": {
            name: {run: medians(values) for run, values in told.items()} for name, told in found.items()
        },
    }


def medians(values: list[dict[str, float]]) -> dict[str, float]:
    """Median of each figure."""
    return {key: float(np.median([value[key] for value in values])) for key in values[0]}


def second_runs(settings: Mapping[str, Any], seed: int, turning: Any = PATENT_STEPS, **changed: float) -> Any:
    """The patent's staircase and the second one of a unit with settings changed."""
    twin, latitude = unit(settings, **changed), settings["latitude"]
    return (
        made(patent_staircase(turning), twin, latitude, 10 * seed).run,
        made(second_staircase(settings), twin, latitude, 10 * seed + 2).run,
    )


def on_second(settings: Mapping[str, Any], window_s: float = 64.0, **changed: Any) -> dict[str, float]:
    """Medians over three seeds of what the joint model leaves on the second staircase."""
    found = []
    for seed in settings["seeds"][:3]:
        train, test = second_runs(settings, seed, **changed)
        found.append(figures(test, joint(train, window_s=window_s), settings["averaging"]))
    return medians(found)


def sensitivities(settings: Mapping[str, Any]) -> dict[str, Any]:
    """The joint model by window and resolution, number of soaks with turns, and hysteresis."""
    windows: dict[str, dict[str, dict[str, float]]] = {"T_in and T_out": {}, "T_in alone": {}}
    for resolution in settings["resolutions"]:
        pair = second_runs(settings, settings["seeds"][0], sensor_resolution=resolution)
        for sensors, (train, test) in zip(windows, (pair, [only_inner(run) for run in pair])):
            windows[sensors][str(resolution)] = {
                str(n): figures(test, joint(train, window_s=2.0**n), settings["averaging"])["rms"]
                for n in settings["windows"]
            }
    turns = {}
    for count in settings["turning_soaks"]:
        places = np.round(np.linspace(0, len(PATENT_STEPS) - 1, count)).astype(int)
        soaks = [PATENT_STEPS[i] for i in places]
        turns[str(count)] = on_second(settings, turning=soaks, scale_hysteresis=0.0)
    bias = {str(size): on_second(settings, bias_hysteresis=size) for size in settings["bias_hystereses"]}
    scale = {str(size): on_second(settings, scale_hysteresis=size) for size in settings["scale_hystereses"]}
    return {"windows": windows, "turning_soaks": turns, "bias_hysteresis": bias, "scale_hysteresis": scale}


def rate_quality(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Correlation of the difference of block means with the true rate, no thermal lag, by window."""
    told = settings["quality"]
    chamber = set_point()
    time = np.arange(len(chamber), dtype=np.float64)
    noise = np.random.default_rng(0).normal(scale=told["noise"], size=len(time))
    rate = np.diff(chamber, prepend=chamber[0])
    found: dict[str, dict[str, float]] = {}
    for name, spread in (("noise", noise), ("no noise", 0.0 * noise)):
        seen = told["resolution"] * np.round((chamber + spread) / told["resolution"])
        run = Run("chamber", {"time": time, "gyro": 0.0 * time, "T": seen})
        found[name] = {}
        for n in told["windows"]:
            text = "diff(T)[first]" if n == 0 else f"diff(T)[block, {2**n} s]"
            values, full, _ = parse_features(text).atom_values(run)
            found[name][str(n)] = float(np.corrcoef(values[full, 0], rate[full])[0, 1])
    return found


def results(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Every figure of the page."""
    return {
        "version": __version__,
        "known": known(settings),
        "compared": compared(settings),
        "sensitivity": sensitivities(settings),
        "rate_quality": rate_quality(settings),
    }


def main(quick: bool = False) -> None:
    """Compute, and write unless quick."""
    settings = settings_of(quick)
    values = results(settings)
    text = page(values, settings)
    if not quick:
        write_results(HERE, values, text, drawings(values))
    print(text)


if __name__ == "__main__":
    main("--quick" in sys.argv[1:])
