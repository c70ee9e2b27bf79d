"""Models of the multi-point paper fitted at 1 degC/min and scored on other runs of the same synthetic unit.

Run ``python -m experiments.multipoint_table``; it writes ``results.json`` and ``results.md`` beside itself.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from experiments.results import write_results
from fogml import __version__
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin

HERE = Path(__file__).parent
SAMPLE_S = 10.0
SENSORS = ("T1", "T2", "T3", "T4")
MODELS = (
    ("none", "none"),
    ("M1", "M1"),
    ("M2", "M2"),
    ("M3", "M3"),
    ("M4", "M4"),
    ("4 points 5/3", "multipoint-5-3"),
    ("4 points 2/1", "multipoint-2-1"),
)
RUNS = ("in sample", "repeat", "0.5 degC/min", "2 degC/min", "reversed order")
STATED = {
    "none": (0.427, 0.427, 0.386, 0.536, 0.435),
    "M1": (0.268, 0.268, 0.185, 0.457, 0.228),
    "M2": (0.099, 0.098, 0.157, 0.362, 0.189),
    "M3": (0.086, 0.086, 0.141, 0.339, 0.184),
    "M4": (0.287, 0.287, 0.296, 5.38, 0.362),
    "4 points 5/3": (0.0499, 0.050, 0.109, 0.223, 0.095),
    "4 points 2/1": (0.0516, 0.053, 0.053, 0.060, 0.054),
}
"""Figures of the formulas' reference, which come from a prototype's own world."""


def unit() -> Twin:
    """Static bias to third order, thermal stress with a slope over T, Shupe effect, hysteresis, ripple."""
    places = {
        "T3": SensorErrors(0.002, 0.0, 0.0, {"T_in": 0.8, "T_hub": 0.2}),
        "T4": SensorErrors(0.002, 0.0, 0.0, {"T_out": 0.8, "T_case": 0.2}),
    }
    return (
        Twin("multi-point", sensors=Sensors(SensorErrors(noise=0.002), places))
        .with_nominal(b0=0.1, b1=8e-3, b2=6e-5)
        .with_noise(N=0.047 * np.sqrt(SAMPLE_S) / 60.0)
        .with_effect("bias_polynomial", 0.15, quartic_ratio=0.0, quintic_ratio=0.0)
        .with_effect("shupe_mohr", 0.5, linear_coefficient=4e-3, quadratic_coefficient=0.0)
        .with_effect("shupe_pure", 4.5)
        .with_effect("azimuthal_gradient", 0.8)
        .with_effect("thermal_hysteresis", 0.03, half_width=8.0)
        .with_effect("polarization_nonreciprocity", 0.02)
    )


def programme(rate: float, reverse: bool = False) -> list[str]:
    """The paper's cycle from room temperature at a ramp rate [degC/min]."""
    first, second = (60, -40) if reverse else (-40, 60)
    return [
        f"ramp to {first} degC at {rate} degC/min",
        f"soak at {first} degC for 2 h",
        f"ramp to {second} degC at {rate} degC/min",
        f"soak at {second} degC for 2 h",
    ]


def runs() -> dict[str, Run]:
    """The run that is fitted, and the others."""
    asked = {
        "in sample": (programme(1.0), 1),
        "repeat": (programme(1.0), 2),
        "0.5 degC/min": (programme(0.5), 3),
        "2 degC/min": (programme(2.0), 4),
        "reversed order": (programme(1.0, reverse=True), 5),
    }
    return {
        name: simulate(steps, unit(), sample_s=SAMPLE_S, seed=seed, columns=SENSORS).run
        for name, (steps, seed) in asked.items()
    }


def table() -> dict[str, dict[str, Any]]:
    """Per model its number of coefficients and the standard deviation on each run [deg/h]."""
    made = runs()
    rows: dict[str, dict[str, Any]] = {}
    for label, name in MODELS:
        model = make_model(name).fit(made["in sample"])
        scored = {}
        for run_name, run in made.items():
            compensation = model.compensate(run)
            full = compensation.flag != 2
            scored[run_name] = float(np.std((compensation.compensated - run.reference_deg_h)[full]))
        rows[label] = {"coefficients": model.describe()["parameters"], "std": scored}
    return rows


def page(rows: dict[str, dict[str, Any]]) -> str:
    """The result page."""

    def lines(values: dict[str, Any], count: dict[str, Any]) -> list[str]:
        return [
            f"| {label} | {count[label]} | " + " | ".join(f"{v:.3g}" for v in values[label]) + " |"
            for label, _ in MODELS
        ]

    head = ["| model | coefficients | " + " | ".join(RUNS) + " |", "|---|---:|" + "---:|" * len(RUNS)]
    count = {label: row["coefficients"] for label, row in rows.items()}
    ours = {label: [row["std"][name] for name in RUNS] for label, row in rows.items()}
    five, two = ours["4 points 5/3"], ours["4 points 2/1"]
    return f"""# Multi-point models, in sample and elsewhere

Data: **synthetic**, `fogml.twin`: cubic static bias, thermal stress that depends on T, Shupe effect radial
and side-on, play hysteresis, polarisation ripple, white noise of 0.047 deg/h in {SAMPLE_S:.0f} s, four coil
sensors with 2 mdegC of noise. Every model is fitted on one run 25 → −40 → 60 °C at 1 °C/min; figures are
standard deviations [deg/h] of {SAMPLE_S:.0f} s samples. fogml {__version__};
`python -m experiments.multipoint_table`.

{chr(10).join(head + lines(ours, count))}

The stated table, from another world of the same ingredients:

{chr(10).join(head + lines(STATED, count))}

In sample the order is the paper's: temperature, then its rate, then the difference, then more points, down
to the noise. On the same programme once more all keep it. Elsewhere the high orders lose what they gained:
at 2 °C/min orders 5 and 3 go from {five[0]:.3g} to {five[3]:.3g} deg/h, in reversed order to {five[4]:.3g};
orders 2 and 1 go from {two[0]:.3g} to {two[3]:.3g} and {two[4]:.3g}. Features outside what a model was
trained on are limited to its box, so that no model runs away as M4 does in the stated table.
"""


def main() -> None:
    """Compute and write the results."""
    rows = table()
    write_results(HERE, rows, page(rows))
    print(page(rows))


if __name__ == "__main__":
    main()
