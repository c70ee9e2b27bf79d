"""The multi-point paper: sensors, orders, other forms, other runs, choice by training folds, start-up.

Run ``python -m experiments.multipoint_model``; it reads ``config.yaml`` and writes ``results.json``,
``results.md``, ``results.html`` and figures beside itself. ``--quick`` prints a small version.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from experiments.multipoint_model.page import drawings, page
from experiments.multipoint_model.start_up import AVERAGING_S, curve, start_up
from experiments.multipoint_table.__main__ import RUNS, SAMPLE_S, SENSORS, programme, unit
from experiments.results import write_results
from fogml import __version__
from fogml.arrays import FloatArray
from fogml.features.parse import parse_features
from fogml.lab.forms import multipoint_form, rank_forms, sensor_sets, smallest_within
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.signals.averages import block_averages
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin
from fogml.yaml_text import read_yaml

HERE = Path(__file__).parent
CROSS = "T^1..5, dT^1..3, T*dT"
PAPER = ("M1", "M2", "M3", "M4")
Drift = Callable[[Run], FloatArray]


def settings_of(quick: bool) -> dict[str, Any]:
    """The settings, cut down where quick."""
    settings: dict[str, Any] = read_yaml(HERE / "config.yaml")
    if quick:
        settings |= {"orders": [[2, 1], [5, 3]]}
        settings["choice"] = {"orders": [2, 5], "rate_orders": [1, 3], "sensors": [["T1"], [*SENSORS]]}
    return settings


class Recorded:
    """The runs of a unit, and the noise realised in each [deg/h]."""

    def __init__(self, twin: Twin) -> None:
        self.runs: dict[str, Run] = {}
        self.noise: dict[str, FloatArray] = {}
        asked = (programme(1.0), programme(1.0), programme(0.5), programme(2.0), programme(1.0, reverse=True))
        for seed, (name, steps) in enumerate(zip(RUNS, asked, strict=True), start=1):
            made = simulate(steps, twin, sample_s=SAMPLE_S, seed=seed, columns=SENSORS, truth=True)
            assert made.truth is not None
            self.runs[name], self.noise[name] = made.run, made.truth.noise

    @property
    def train(self) -> Run:
        """The run that is fitted."""
        return self.runs["in sample"]

    def left(self, drift: Drift) -> dict[str, dict[str, float]]:
        """What is left of the output on each run: standard deviations, range and the model's own error."""
        return {name: self._figures(name, drift(run)) for name, run in self.runs.items()}

    def _figures(self, name: str, drift: FloatArray) -> dict[str, float]:
        run, noise = self.runs[name], self.noise[name]
        full = np.isfinite(drift)
        error = (run.error_deg_h - drift)[full]
        averages, quiet = block_averages(run.time[full], error, noise[full], window_s=AVERAGING_S).values
        return {
            "std_10s": float(error.std()),
            "std_100s": float(averages.std()),
            "range_100s": float(np.ptp(averages)),
            "own_error": float((error - noise[full]).std()),
            "floor_10s": float(noise[full].std()),
            "floor_100s": float(quiet.std()),
        }


def fitted(name: str, train: Run, features: str | None = None) -> Drift:
    """A model by name, or of features by plain least squares; NaN where windows are not full."""
    parameters = {"ridge": 0.0} if features else None
    model = make_model(name, features, parameters=parameters).fit(train)

    def drift(run: Run) -> FloatArray:
        evaluation = model.evaluate(run)
        return np.where(evaluation.full, evaluation.drift, np.nan)

    return drift


def unlimited(train: Run, text: str) -> Drift:
    """The same form as the paper has it: nothing limits it to what it was trained on."""
    features = parse_features(text)
    model = make_model("polynomial", text, parameters={"ridge": 0.0}).fit(train)

    def drift(run: Run) -> FloatArray:
        atoms, full, _ = features.atom_values(run)
        values = model.regressor_.predict(features.compose(atoms))  # type: ignore[attr-defined]
        return np.where(full, values, np.nan)

    return drift


def in_pieces(train: Run, edges: list[float], order: int) -> Drift:
    """A polynomial in T of its own between neighbouring edges [degC]; T held at the trained range."""
    temperature = train.temperature("T")
    span = float(temperature.min()), float(temperature.max())
    piece = np.digitize(temperature, edges)
    parts = [
        np.polynomial.Polynomial.fit(temperature[piece == k], train.error_deg_h[piece == k], order)
        for k in range(len(edges) + 1)
    ]

    def drift(run: Run) -> FloatArray:
        held = np.clip(run.temperature("T"), *span)
        return np.choose(np.digitize(held, edges), [part(held) for part in parts])

    return drift


def forms(recorded: Recorded, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Coefficients and figures of every form, fitted at 1 degC/min."""
    train = recorded.train
    edges, order = settings["piece_edges"], settings["piece_order"]
    found = {"none": (0, lambda run: np.zeros(len(run)))}
    for name in PAPER:
        found[name] = (make_model(name).fit(train).parameter_count(), fitted(name, train))
    found["T in pieces"] = ((len(edges) + 1) * (order + 1), in_pieces(train, edges, order))
    found["M2 and T·dT"] = (10, fitted("polynomial", train, CROSS))
    for points in range(1, len(SENSORS) + 1):
        for orders in ((5, 3), (2, 1)):
            text = multipoint_form(SENSORS[:points], *orders)
            label = f"{points} point{'s' if points > 1 else ''} {orders[0]}/{orders[1]}"
            found[label] = (len(parse_features(text)) + 1, fitted("polynomial", train, text))
    return {
        name: {"coefficients": count, "runs": recorded.left(drift)} for name, (count, drift) in found.items()
    }


def without_limits(recorded: Recorded) -> dict[str, dict[str, float]]:
    """Standard deviation of 10 s samples [deg/h] by run of forms that nothing limits."""
    texts = {"M4": "(T_in-T_out)^1..5, d(T_in-T_out)^1..3"}
    for points in (1, 2, 4):
        texts[f"{points} point{'s' if points > 1 else ''} 5/3"] = multipoint_form(SENSORS[:points], 5, 3)
    texts["4 points 2/1"] = multipoint_form(SENSORS, 2, 1)
    return {
        label: {
            name: told["std_10s"] for name, told in recorded.left(unlimited(recorded.train, text)).items()
        }
        for label, text in texts.items()
    }


def orders(recorded: Recorded, settings: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Standard deviation of 10 s samples by number of sensors and orders, on each run."""
    rows = []
    for points in range(1, len(SENSORS) + 1):
        for order, rate_order in settings["orders"]:
            text = multipoint_form(SENSORS[:points], order, rate_order)
            left = recorded.left(fitted("polynomial", recorded.train, text))
            std = {name: told["std_10s"] for name, told in left.items()}
            rows.append({"points": points, "order": order, "rate_order": rate_order, "std": std})
    return rows


def choice(recorded: Recorded, settings: Mapping[str, Any]) -> dict[str, Any]:
    """What folds of one training run, and of two at different rates, choose; and what was best in truth."""
    texts = [
        multipoint_form(sensors, order, rate_order)
        for sensors in settings["choice"].get("sensors", sensor_sets(SENSORS))
        for order in settings["choice"]["orders"]
        for rate_order in settings["choice"]["rate_orders"]
    ]
    others = RUNS[1:]
    training = {
        "one run, parts of it left out": [recorded.train],
        "runs at 1 and 0.5 degC/min, each left out": [recorded.train, recorded.runs["0.5 degC/min"]],
    }
    chosen = {}
    for name, runs in training.items():
        ranked = rank_forms(texts, runs)
        picked = {"least error": ranked[0], "smallest within 2 %": smallest_within(ranked)}
        for rule, score in picked.items():
            model = _plain(score.features, runs)
            std = {run: _std(model, recorded.runs[run]) for run in others}
            chosen[f"{name}: {rule}"] = {**asdict(score), "std": std}
    plain = {text: _plain(text, recorded.train) for text in texts}
    judged = {text: {run: _std(model, recorded.runs[run]) for run in others} for text, model in plain.items()}
    best = min(texts, key=lambda text: max(judged[text].values()))
    in_sample = min(texts, key=lambda text: _std(plain[text], recorded.train))
    ends = {
        "least error in sample, as the paper scores": in_sample,
        "best on the test runs themselves (not a choice)": best,
    }
    for name, text in ends.items():
        coefficients = len(parse_features(text)) + 1
        chosen[name] = {
            "features": text,
            "coefficients": coefficients,
            "held_out_rms": None,
            "std": judged[text],
        }
    return {"tried": len(texts), "chosen": chosen}


def _plain(text: str, runs: Run | list[Run]) -> Any:
    return make_model("polynomial", text, parameters={"ridge": 0.0}).fit(runs)


def _std(model: Any, run: Run) -> float:
    evaluation = model.evaluate(run)
    return float(np.std((run.error_deg_h - evaluation.drift)[evaluation.full]))


def quiet_unit(settings: Mapping[str, Any]) -> Twin:
    """The unit with little noise, without loop and ripple."""
    noise = settings["quiet_noise"] * np.sqrt(SAMPLE_S) / 60.0
    return unit().without_effect("thermal_hysteresis", "polarization_nonreciprocity").with_noise(N=noise)


def results(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Every figure of the page."""
    recorded = Recorded(unit())
    time_h, series = curve(settings)
    return {
        "version": __version__,
        "forms": forms(recorded, settings),
        "quiet": forms(Recorded(quiet_unit(settings)), settings),
        "unlimited": without_limits(recorded),
        "orders": orders(recorded, settings),
        "choice": choice(recorded, settings),
        "start_up": start_up(settings),
        "start_up_curve": {"time_h": time_h.tolist(), **{name: y.tolist() for name, y in series.items()}},
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
