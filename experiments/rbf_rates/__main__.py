"""Trained at one ramp rate or at three, judged at others: RBF network, cubic and Gaussian process.

Run ``python -m experiments.rbf_rates``; it writes ``results.json`` and ``results.md`` beside itself.
Errors are against the noise-free truth, so no noise floor hides them.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from experiments.results import write_results
from experiments.synthetic_world import World, programme
from fogml import __version__
from fogml.arrays import FloatArray
from fogml.features.parse import parse_features
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.signals.averages import block_averages

HERE = Path(__file__).parent
UNITS = range(300, 312)
FEATURES = "T, dT, T*dT"
TRAINING = {"one rate": (1.0,), "two rates": (0.5, 1.0), "three rates": (0.5, 1.0, 2.0)}
TESTS = {"slower": 0.7, "faster": 1.5, "beyond": 2.5}
PROCESS_ROWS = 500
EVERY = 25  # error is taken at every so many samples
CUBIC, NETWORK, PROCESS = "cubic(T), dT, T·dT", "RBF network", "Gaussian process"
Predict = Callable[[Run], FloatArray]


def world(seed: int, noise: float = 0.05) -> World:
    """A unit drawn from a seed: static curve that no cubic follows, gradient, rate and T times rate."""
    draw = np.random.default_rng([seed, 11])
    signs = draw.choice([-1.0, 1.0], 4)
    return World(
        polynomial=tuple(draw.normal(0.0, 1.0, 4) * [0.3, 8e-3, 1e-4, 1e-6]),
        gradient=float(signs[0] * draw.uniform(0.01, 0.04)),
        rate=float(signs[1] * draw.uniform(0.05, 0.2)),
        product=float(signs[2] * draw.uniform(1e-3, 4e-3)),
        noise=noise,
        ripple=(float(signs[3] * draw.uniform(0.02, 0.06)), float(draw.uniform(30.0, 60.0))),
    )


def chamber(rates: tuple[float, ...]) -> FloatArray:
    """-10 -> 40 -> -10 degC once at each rate [degC/min], half an hour's soak at each end, 1 Hz."""
    steps: list[tuple[str, float, float]] = [("soak", 30.0, 0.0)]
    for rate in rates:
        steps += [("ramp", 40.0, rate), ("soak", 30.0, 0.0), ("ramp", -10.0, rate), ("soak", 30.0, 0.0)]
    return programme(steps, -10.0, 1.0)


def gaussian_process(train: Run) -> Predict:
    """A process with own width for each input and a linear kernel, free beyond its training rows."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel

    features = parse_features(FEATURES)
    full = features.atom_values(train)[1]
    window_s = train.span_s / PROCESS_ROWS
    means = block_averages(
        train.time[full], features.transform(train)[full], train.gyro[full], window_s=window_s
    )
    inputs, target = means.values
    shift, scale, level, spread = inputs.mean(axis=0), inputs.std(axis=0), target.mean(), target.std()
    kernel = (
        ConstantKernel(1.0, (1e-3, 1e3)) * RBF([1.0, 5.0, 5.0], (0.05, 1e3))
        + ConstantKernel(1.0, (1e-3, 1e3)) * DotProduct(1.0, (1e-3, 1e3))
        + WhiteKernel(0.1, (1e-8, 1.0))
    )
    process = GaussianProcessRegressor(kernel, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit((inputs - shift) / scale, (target - level) / spread)

    def predict(run: Run) -> FloatArray:
        columns = (features.transform(run)[::EVERY] - shift) / scale
        return np.repeat(np.asarray(process.predict(columns) * spread + level), EVERY)[: len(run)]

    return predict


def fitted(train: Run) -> dict[str, Predict]:
    """The models compared, fitted."""
    return {
        NETWORK: make_model("rbf", FEATURES).fit(train).predict,
        CUBIC: make_model("polynomial", "T^1..3, dT, T*dT").fit(train).predict,
        PROCESS: gaussian_process(train),
    }


def rms_error(predict: Predict, run: Run, truth: FloatArray) -> float:
    """Rms of prediction less truth [deg/h], windows being full."""
    rows = slice(5 * EVERY, None, EVERY)
    return float(np.sqrt(np.mean((predict(run)[rows] - truth[rows]) ** 2)))


def case(seed: int) -> list[dict]:
    """Errors on one unit: each training, each test, each model."""
    unit = world(seed)
    tests = {name: unit.run(chamber((rate,)), 1.0, 1000 + seed, name) for name, rate in TESTS.items()}
    rows = []
    for training, rates in TRAINING.items():
        train, _ = unit.run(chamber(rates), 1.0, seed, training)
        models = fitted(train)
        for test, (run, truth) in tests.items():
            errors = {name: rms_error(predict, run, truth) for name, predict in models.items()}
            rows.append({"unit": seed, "training": training, "test": test, "rms_error": errors})
    return rows


def table(rows: list[dict]) -> str:
    """The results as a page."""
    lines = [
        "# One ramp rate, two, or three",
        "",
        f"Data: **synthetic** ({len(UNITS)} units drawn by `experiments/synthetic_world.py`): static curve",
        "with a ripple that no cubic follows, gradient, block-differenced rate and T·dT in the truth, white",
        "noise of 0.05 deg/h a sample, 1 Hz, −10 to 40 °C up and down once at each rate. Figures are the rms",
        "difference from the noise-free truth on another run [deg/h], geometric means over the units; in",
        "brackets the largest ratio on one unit. The process has own widths and a linear kernel. With fewer",
        "than three rates the network is of T alone, dT and T·dT linear beside it.",
        f"fogml {__version__}; `python -m experiments.rbf_rates`.",
        "",
        "| trained at | judged at | network | cubic | process | network / cubic | network / process |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]
    for training, rates in TRAINING.items():
        for test, rate in TESTS.items():
            chosen = [row["rms_error"] for row in rows if (row["training"], row["test"]) == (training, test)]
            means = {name: mean_of([errors[name] for errors in chosen]) for name in (NETWORK, CUBIC, PROCESS)}
            ratios = [[errors[NETWORK] / errors[other] for errors in chosen] for other in (CUBIC, PROCESS)]
            told = [f"{mean_of(ratio):.2f} (up to {max(ratio):.2f})" for ratio in ratios]
            cells = [", ".join(f"{r:g}" for r in rates), f"{rate:g} ({test})"]
            cells += [f"{means[name]:.4f}" for name in means] + told
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def mean_of(values: list[float]) -> float:
    """Geometric mean."""
    return float(np.exp(np.mean(np.log(values))))


def main() -> None:
    """Run every unit and write the results."""
    rows = [row for seed in UNITS for row in case(seed)]
    write_results(HERE, rows, table(rows))


if __name__ == "__main__":
    main()
