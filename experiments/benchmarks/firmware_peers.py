"""Other exporters' models of the same drift: emlearn's perceptron and m2cgen's support vector regression.

Settings are chosen on the training run alone: fitted to its slowest and fastest cycle, judged on the
one between. Of each size the best settings are kept, and the smallest size is shown that is within
`NEAR` of the best judged; it is fitted to the whole training run.
"""

from __future__ import annotations

import re
import tempfile
import warnings
from collections.abc import Iterable
from contextlib import chdir
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.benchmarks.firmware_cost import cortex_bytes, instructions
from fogml.arrays import FloatArray

NEAR = 1.01
"""Ratio of judged errors within which the smaller model is taken."""
_JUDGED_S = 120
SIZES, RIDGES, STARTS = (4, 6, 8, 12, 16, 24), (1e-3, 3e-3, 1e-2, 3e-2, 1e-1), range(4)
RATE_SCALES, WIDTHS, COSTS = (0.05, 0.1, 0.2, 1.0), (0.5, 1.0, 2.0, 3.0, 5.0), (30.0, 100.0, 300.0)
TUBES = (0.2, 0.1, 0.07, 0.05, 0.03)
"""Of support vectors: scale of rates against temperature, gamma, C, and epsilon over y's deviation."""


@dataclass(frozen=True)
class Rows:
    """Averaged training rows.

    Attributes
    ----------
    x
        T, dT and T*dT, shape (n, 3).
    y
        Drift [deg/h], shape (n,).
    held
        Rows of the cycle that settings are judged on, shape (n,).
    row_s
        What a row averages over [s].
    """

    x: FloatArray
    y: FloatArray
    held: NDArray[np.bool_]
    row_s: int

    def averaged(self, width: int) -> Rows:
        """Averages of so many rows, those of both kinds left out."""
        count = len(self.y) // width
        held = self.held[: count * width].reshape(count, width)
        whole = held.all(axis=1) == held.any(axis=1)
        x = self.x[: count * width].reshape(count, width, -1).mean(axis=1)
        y = self.y[: count * width].reshape(count, width).mean(axis=1)
        return Rows(x[whole], y[whole], held.all(axis=1)[whole], self.row_s * width)

    def judged(self, left: FloatArray) -> float:
        """Root mean square of 120 s averages of what is left of the held rows [deg/h]."""
        width = _JUDGED_S // self.row_s
        count = len(left) // width
        return float(np.sqrt(np.mean(left[: count * width].reshape(count, width).mean(axis=1) ** 2)))


@dataclass(frozen=True)
class Fitted:
    """A model of one size: ``size`` of its kind, scikit-learn's `model`, scaling of inputs and output."""

    size: int
    judged: float
    model: Any
    shift: FloatArray
    scale: FloatArray
    y_shift: float
    y_scale: float

    def drift(self, x: FloatArray) -> FloatArray:
        """Drift [deg/h] of rows of features."""
        return np.asarray(self.y_shift + self.y_scale * self.model.predict(self.inputs(x)))

    def inputs(self, x: FloatArray) -> FloatArray:
        """What the model is given for rows of features."""
        return np.asarray((x - self.shift) / self.scale)


def perceptrons(rows: Rows) -> list[Fitted]:
    """The best judged perceptron of one layer of tanh of each size."""
    from sklearn.neural_network import MLPRegressor

    shift, scale = rows.x.mean(axis=0), rows.x.std(axis=0)
    y_shift, y_scale = float(rows.y.mean()), float(rows.y.std())
    inputs, target, held = (rows.x - shift) / scale, (rows.y - y_shift) / y_scale, rows.held
    found = []
    for size in SIZES:
        tried = []
        for ridge, start in product(RIDGES, STARTS):
            model = MLPRegressor(
                hidden_layer_sizes=(size,),
                activation="tanh",
                solver="lbfgs",
                alpha=ridge,
                tol=1e-9,
                max_iter=20000,
                max_fun=10**6,
                random_state=start,
                warm_start=True,
            )
            model.fit(inputs[~held], target[~held])
            left = (target[held] - model.predict(inputs[held])) * y_scale
            tried.append((rows.judged(left), model))
        judged, best = min(tried, key=lambda pair: pair[0])
        # From where it stands, as another start would end elsewhere.
        best.fit(inputs, target)
        found.append(Fitted(size, judged, best, shift, scale, y_shift, y_scale))
    return found


def support_vectors(rows: Rows) -> list[Fitted]:
    """The best judged support vector regression of each width of the tube."""
    from sklearn.svm import SVR

    few = rows.averaged(_JUDGED_S // rows.row_s)
    y_shift, y_scale = float(few.y.mean()), float(few.y.std())
    shift, target, held = few.x.mean(axis=0), (few.y - y_shift) / y_scale, few.held
    found = []
    for tube in TUBES:
        tried = []
        for rate_scale, width, cost in product(RATE_SCALES, WIDTHS, COSTS):
            scale = few.x.std(axis=0) / np.array([1.0, rate_scale, rate_scale])
            inputs = (few.x - shift) / scale
            model = SVR(C=cost, epsilon=tube, gamma=width, cache_size=500).fit(inputs[~held], target[~held])
            left = (target[held] - model.predict(inputs[held])) * y_scale
            tried.append((few.judged(left), model, scale))
        judged, best, scale = min(tried, key=lambda some: some[0])
        best.fit((few.x - shift) / scale, target)
        found.append(Fitted(len(best.support_), judged, best, shift, scale, y_shift, y_scale))
    return found


def smallest(found: Iterable[Fitted]) -> Fitted:
    """The smallest model that is judged within `NEAR` of the best."""
    models = sorted(found, key=lambda model: model.size)
    best = min(model.judged for model in models)
    return next(model for model in models if model.judged <= NEAR * best)


def weight_bytes(model: Any) -> int:
    """Bytes of a model's numbers: float32 for perceptrons, float64 for support vectors."""
    if hasattr(model, "coefs_"):
        return int(4 * sum(w.size for w in (*model.coefs_, *model.intercepts_)))
    return int(8 * (model.support_vectors_.size + model.dual_coef_.size + 1))


def emlearn_cost(fitted: Fitted, x: FloatArray) -> dict[str, Any]:
    """Flash and instructions of emlearn's C, from scaled features to scaled drift."""
    import emlearn

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with warnings.catch_warnings(), chdir(folder):
            # It leaves what it compiles where it is called.
            warnings.simplefilter("ignore")
            converted = emlearn.convert(fitted.model, method="inline", dtype="float")
        converted.save(file=str(folder / "mlp.h"), name="mlp")
        text = (folder / "mlp.h").read_text()
        names = ("mlp_regress1", "mlp_predict")
        call = next((f for f in names if re.search(rf"\b{f}\s*\(", text)), names[0])
        include = ["-I", str(Path(emlearn.__file__).parent), f"-I{emlearn.includedir}"]
        rows = fitted.inputs(x).astype("f4")
        head = '#include "mlp.h"\n'
        count = instructions(folder, head, f"{call}(x[row], {rows.shape[1]})", "float", rows, include)
        probe = f"{head}float probe(const float *x) {{ return {call}(x, {rows.shape[1]}); }}\n"
        return {"flash": cortex_bytes(folder, probe, include), "instructions": count}


def m2cgen_cost(fitted: Fitted, x: FloatArray) -> dict[str, Any]:
    """Flash and instructions of m2cgen's C, from scaled features to scaled drift."""
    import m2cgen

    text = m2cgen.export_to_c(fitted.model)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        count = instructions(folder, text, "score(x[row])", "double", fitted.inputs(x), [])
        return {"flash": cortex_bytes(folder, text, []), "instructions": count}
