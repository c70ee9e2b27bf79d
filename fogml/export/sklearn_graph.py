"""scikit-learn's regressors that have no compact form (trees, perceptrons, neighbours) as ONNX graphs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError, first_line, install_words
from fogml.export.check import Difference, value_difference
from fogml.export.onnx_graph import BEYOND, ONNX_FILE, OPSET, finished_model, session_of
from fogml.export.plan import Plan
from fogml.export.settings import ExportSettings, hold_within, report_head, report_tail, tolerance_of
from fogml.models.base import DriftModel
from fogml.models.compact import Compact, affine, network_of
from fogml.models.regressors import predict_rows
from fogml.models.sklearn_model import SklearnModel

if TYPE_CHECKING:
    import onnx

_ML_OPSET = 3
"""Of the operators for trees and their like (domain ai.onnx.ml)."""


def export_graph(model: DriftModel, folder: Path, dtype: str, settings: ExportSettings) -> dict[str, Any]:
    """As `fogml.export.export.export_model`, of a model that a graph alone can hold.

    Raises
    ------
    InputError
        If skl2onnx is not installed or can't convert it, or the graph differs by more than the tolerance.
    """
    assert isinstance(model, SklearnModel)
    if settings.pipeline or settings.budget is not None:
        option = "--with-pipeline" if settings.pipeline else "--bytes"
        raise InputError(f"export: {option} is not for a model of kind '{model.kind}'; leave it out")
    features = model.features_
    runs = ", ".join(run.name for run in model.card_.runs)
    told = f"{model.kind} of {features.text}, trained on {runs}"
    data = _sklearn_onnx(model, dtype, told).SerializeToString()
    # The features without the regressor, for their points.
    zero = Compact(model.kind, affine(np.zeros(len(features)), 0.0))
    plan = Plan.with_features(zero, features, model.card_.sample_s)
    difference = sklearn_difference(model, plan, data, dtype, settings.seed)
    tolerance = tolerance_of(model, settings, dtype)
    hold_within(difference.inside, difference, tolerance, settings, dtype)
    (folder / ONNX_FILE).write_bytes(data)
    head = report_head(settings, dtype, plan, difference, tolerance, weight_bytes=len(data), operations=None)
    return {**head, "beyond_the_box": BEYOND[False], **report_tail(folder)}


def is_graph_alone(model: DriftModel) -> bool:
    """Whether a model is one of scikit-learn's without a compact form."""
    return isinstance(model, SklearnModel) and network_of(model.regressor_) is None


def sklearn_difference(model: SklearnModel, plan: Plan, data: bytes, dtype: str, seed: int) -> Difference:
    """Difference of a graph from its regressor, at points of its features' trained box and around it."""
    session = session_of(data)
    real = np.float64 if dtype == "float64" else np.float32

    def off(columns: FloatArray, gyro: FloatArray) -> FloatArray:
        (drift,) = session.run(["drift"], {"features": columns.astype(real)})
        return np.asarray(drift, dtype=np.float64) - predict_rows(model.regressor_, columns)

    return value_difference(plan, off, seed)


def _sklearn_onnx(model: SklearnModel, dtype: str, card: str) -> onnx.ModelProto:
    """The graph of a scikit-learn regressor, by skl2onnx: ``features`` (n, k) to ``drift`` (n) [deg/h]."""
    try:
        from onnx import TensorProto, helper, numpy_helper
        from skl2onnx import convert_sklearn
        from skl2onnx.common.data_types import DoubleTensorType, FloatTensorType
    except ImportError:
        raise InputError(f"export: skl2onnx is not installed; {install_words('export')}") from None
    double = dtype == "float64"
    real, kind = (np.float64, TensorProto.DOUBLE) if double else (np.float32, TensorProto.FLOAT)
    width, fitted = len(model.feature_names), model.regressor_
    entry = (DoubleTensorType if double else FloatTensorType)([None, width])
    try:
        inner = convert_sklearn(
            fitted.regressor_,
            initial_types=[("features", entry)],
            target_opset={"": OPSET, "ai.onnx.ml": _ML_OPSET},
        )
    except Exception as error:  # a converter's own faults are of any kind
        raise InputError(
            f"export: skl2onnx can't write a model of kind '{model.kind}' in {dtype}: {first_line(error)}"
        ) from None
    graph = inner.graph
    output = fitted.transformer_
    constants: dict[str, Any] = {
        "fogml_size": output.scale_.astype(real),
        "fogml_level": output.mean_.astype(real),
        "fogml_row": np.array([-1]),
    }
    nodes = [
        helper.make_node("Mul", [graph.output[0].name, "fogml_size"], ["fogml_sized"]),
        helper.make_node("Add", ["fogml_sized", "fogml_level"], ["fogml_drifts"]),
        helper.make_node("Reshape", ["fogml_drifts", "fogml_row"], ["drift"]),
    ]
    whole = helper.make_graph(
        [*graph.node, *nodes],
        "fogml",
        [helper.make_tensor_value_info("features", kind, ["n", width])],
        [helper.make_tensor_value_info("drift", kind, ["n"])],
        [*graph.initializer, *(numpy_helper.from_array(v, name) for name, v in constants.items())],
        doc_string=card,
    )
    return finished_model(whole, model.feature_names, model.card_.sample_s, model.kind, False, _ML_OPSET)
