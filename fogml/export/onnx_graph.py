"""A plan as an ONNX graph: from features, or from the temperatures' window, to drift."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fogml import __version__
from fogml.arrays import FloatArray
from fogml.errors import InputError, first_line, install_words
from fogml.export.onnx_nodes import Graph
from fogml.export.plan import Plan
from fogml.export.storage import Stored
from fogml.features.atoms import DEAD_BAND, Atom, evaluate
from fogml.features.slices import Slices
from fogml.runs.columns import is_temperature
from fogml.runs.dropouts import RULE
from fogml.runs.run import Run

if TYPE_CHECKING:
    import onnx


OPSET, IR_VERSION = 17, 8
ONNX_FILE = "fogml_model.onnx"
BEYOND = {
    True: "levelled off, and flagged by the output 'flag', as is a window with what is no reading, beyond "
    f"{RULE.low_degC:g} to {RULE.high_degC:g} degC or no number, whose drift is NaN",
    False: "neither levelled off nor flagged: limit the features to the trained box first, as fogml's "
    "Features.limit does, or export --with-pipeline or --to c",
}
"""What a graph does beyond the trained box, by whether it is one from a window."""
_MOST_WINDOW = 200_000


def onnx_model(
    plan: Plan, stored: Mapping[str, Stored], dtype: str, pipeline: bool, card: str
) -> onnx.ModelProto:
    """The graph of a plan.

    Inputs are ``features`` (n, k), limited as `Features.limit` does, or with `pipeline`
    ``temperatures`` (n, m, s): n windows of the last m samples of s temperatures, newest last; a
    joint model takes ``gyro`` (n) [deg/h] besides. The output is ``drift`` (n) [deg/h]; with `pipeline`,
    which levels off beyond the trained box itself, ``flag`` (n) too: 1 outside the box, else 0. Of
    a window with what is no reading of a thermometer, NaN too, the drift is NaN and the flag 1.

    Raises
    ------
    InputError
        If onnx is not installed, or the model does not fit the interface.
    """
    try:
        from onnx import TensorProto, helper
    except ImportError:
        raise InputError(f"export: onnx is not installed; {install_words('export')}") from None
    if not plan.names:
        raise InputError(
            f"export: a model of kind '{plan.kind}' has no features, so no graph; export it --to c or json"
        )
    if plan.gives_rate and plan.gyro_unit != "deg/h":
        raise InputError(
            f"export: this joint model takes the output in {plan.gyro_unit} and gives a rate, which ONNX's "
            "output 'drift' can't hold; export it --to c"
        )
    kind = TensorProto.DOUBLE if dtype == "float64" else TensorProto.FLOAT
    graph = Graph(kind)
    inputs = []
    if pipeline:
        weights = window_weights(plan)
        inputs.append(helper.make_tensor_value_info("temperatures", kind, ["n", *weights.shape[:2]]))
        columns, outside, none = _columns_of_window(graph, plan, weights)
    else:
        inputs.append(helper.make_tensor_value_info("features", kind, ["n", len(plan.names)]))
        columns = "features"
    drift = _value(graph, plan, stored, columns)
    if pipeline:
        drift = graph.add("Where", [graph.add("Cast", [none], to=9), graph.constant(np.nan), drift])
        outside = graph.add("Max", [outside, none])
    if plan.gives_rate:
        inputs.append(helper.make_tensor_value_info("gyro", kind, ["n"]))
    graph.add("Identity", [drift], "drift")
    outputs = [helper.make_tensor_value_info("drift", kind, ["n"])]
    if pipeline:
        graph.add("Identity", [outside], "flag")
        outputs.append(helper.make_tensor_value_info("flag", TensorProto.INT64, ["n"]))
    whole = helper.make_graph(graph.nodes, "fogml", inputs, outputs, graph.constants, doc_string=card)
    return finished_model(whole, plan.sensors if pipeline else plan.names, plan.sample_s, plan.kind, pipeline)


def finished_model(
    graph: onnx.GraphProto,
    inputs: Sequence[str],
    sample_s: float,
    kind: str,
    pipeline: bool,
    ml_opset: int | None = None,
) -> onnx.ModelProto:
    """A graph as a checked model that tells what goes in, and what it does beyond the trained box.

    `ml_opset` is the version of the operators for trees and their like, where there are any.
    """
    from onnx import checker, helper

    opset = [helper.make_opsetid("", OPSET)]
    if ml_opset is not None:
        opset.append(helper.make_opsetid("ai.onnx.ml", ml_opset))
    model = helper.make_model(
        graph, opset_imports=opset, ir_version=IR_VERSION, producer_name="fogml", producer_version=__version__
    )
    facts = {
        "inputs": ", ".join(inputs),
        "sample_s": repr(sample_s),
        "unit": "deg/h",
        "model": kind,
        "beyond_the_box": BEYOND[pipeline],
    }
    helper.set_model_props(model, facts)
    checker.check_model(model, full_check=True)
    return model


def session_of(data: bytes) -> Any:
    """A graph ready to run on this machine.

    Raises
    ------
    InputError
        If onnxruntime is not installed, or can't run the graph.
    """
    # It keeps an identity of the machine in the home folder else, and tells its maker of its use.
    os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
    try:
        from onnxruntime import InferenceSession
    except ImportError:
        raise InputError(f"export: onnxruntime is not installed; {install_words('export')}") from None
    try:
        return InferenceSession(data, providers=["CPUExecutionProvider"])
    except Exception as error:  # of its own kinds, which it does not tell apart
        raise InputError(
            f"export: onnxruntime can't run the graph: {first_line(error)}; use --dtype float32"
        ) from None


def window_weights(plan: Plan) -> FloatArray:
    """Weights of the last m samples of each temperature in each atom, shape (m, s, a), newest last.

    Every window is linear in the temperatures; directions get the weights of their rates. The
    weights are what the library's own windows give for an impulse.

    Raises
    ------
    InputError
        If the windows look back too far, or something remembers more than any window holds.
    """
    for atom in plan.atoms:
        if atom.declared is not None or not all(is_temperature(name) for name in atom.signal.sensors):
            raise InputError(
                f"export: the model takes {atom.text}; a graph from a window holds windows of "
                "temperatures alone; leave out --with-pipeline, or export --to c"
            )
    rates = tuple(
        Atom("d", atom.signal, atom.window) if atom.operator == "sign" else atom for atom in plan.atoms
    )
    memory = max((atom.window.memory_s for atom in rates if atom.window), default=0.0)
    length = int(np.ceil(memory / plan.sample_s - 1e-6)) + 2
    if length * max(1, len(plan.sensors)) > _MOST_WINDOW:
        raise InputError(
            f"export: the windows look back over {length} samples, too many for a graph; "
            "leave out --with-pipeline"
        )
    weights = np.zeros((length, len(plan.sensors), len(rates)))
    time = np.asarray(plan.sample_s * np.arange(2 * length - 1), dtype=np.float64)
    for place, sensor in enumerate(plan.sensors):
        columns = {"time": time} | {name: np.zeros(len(time)) for name in ("gyro", *plan.sensors)}
        columns[sensor][length - 1] = 1.0
        answers = np.empty((len(rates), len(time)))
        evaluate(rates, Run("impulse", columns), plan.sample_s, list(answers))
        weights[:, place] = answers[:, length - 1 :][:, ::-1].T
    return weights


def _columns_of_window(graph: Graph, plan: Plan, weights: FloatArray) -> tuple[str, str, str]:
    """Feature columns (n, k); whether a window's end lies outside the trained box, and whether it holds what
    is no reading, int64 (n) each."""
    flat = graph.add("Reshape", ["temperatures", graph.whole([-1, weights.shape[0] * weights.shape[1]])])
    none = graph.beside(flat, plan.thermometer.low_degC, plan.thermometer.high_degC)
    rows = graph.add("Cast", [graph.add("Unsqueeze", [none, graph.whole([1])])], to=9)  # TensorProto.BOOL
    values = graph.add("MatMul", [flat, graph.constant(weights.reshape(-1, weights.shape[2]))])
    # NaN has no place among slices, and would end a whole batch.
    atoms = graph.add("Where", [rows, graph.constant(0.0), values])
    signs = np.array([atom.operator == "sign" for atom in plan.atoms])
    if signs.any():
        band = graph.constant(DEAD_BAND * (1.0 + 1e-9))
        below = graph.constant(-DEAD_BAND * (1.0 + 1e-9))
        up = graph.add("Cast", [graph.add("Greater", [atoms, band])], to=graph.kind)
        down = graph.add("Cast", [graph.add("Less", [atoms, below])], to=graph.kind)
        direction = graph.add("Sub", [up, down])
        atoms = graph.add("Where", [graph.constant(signs, np.bool_), direction, atoms])
    limits = plan.limits
    outside = graph.outside(atoms, graph.constant(limits.inner), graph.constant(limits.outer))
    if limits.slices is not None:
        outside = graph.add("Max", [outside, _beyond_slice(graph, limits.slices, atoms)])
    low, high, margin, zero = (graph.constant(v) for v in (limits.low, limits.high, limits.margin, 0.0))
    over = graph.add("Max", [graph.add("Sub", [atoms, high]), zero])
    under = graph.add("Max", [graph.add("Sub", [low, atoms]), zero])
    inside = graph.add("Min", [graph.add("Max", [atoms, low]), high])
    for sign, beyond in (("Add", over), ("Sub", under)):
        soft = graph.add("Div", [graph.add("Mul", [margin, beyond]), graph.add("Add", [margin, beyond])])
        inside = graph.add(sign, [inside, soft])
    columns: list[str] = []
    for step in plan.steps:
        factors = [graph.gather(inside, [i]) for i in step.atoms]
        value = columns[step.column] if step.column is not None else factors.pop(0)
        for factor in factors:
            value = graph.add("Mul", [value, factor])
        columns.append(value)
    return graph.add("Concat", columns, axis=1), outside, none


def _beyond_slice(graph: Graph, slices: Slices, atoms: str) -> str:
    """Whether an input of atoms (n, a) lies beyond its trained range at this temperature, int64 (n)."""
    level = graph.add("Sub", [graph.gather(atoms, [slices.level]), graph.constant(slices.first)])
    share = graph.add("Div", [level, graph.constant(slices.width)])
    most = graph.constant(slices.low.shape[1] - 1.0)
    place = graph.add("Min", [graph.add("Max", [share, graph.constant(0.0)]), most])
    place = graph.add("Squeeze", [graph.add("Cast", [place], to=7), graph.whole([1])])
    inputs = []
    for i, j in zip(slices.of, slices.less):
        value = graph.gather(atoms, [i])
        inputs.append(value if j < 0 else graph.add("Sub", [value, graph.gather(atoms, [j])]))
    value = graph.add("Concat", inputs, axis=1)
    low, high = (
        graph.add("Gather", [graph.constant(np.ascontiguousarray(ends.T)), place], axis=0)
        for ends in slices.bounds
    )
    return graph.outside(value, low, high)


def _value(graph: Graph, plan: Plan, stored: Mapping[str, Stored], columns: str) -> str:
    """Drift (n) of feature columns (n, k)."""
    constant = graph.stored(stored["constant"])
    linear = graph.sum(graph.add("Mul", [columns, graph.stored(stored["linear"])]), 1)
    value = graph.add("Add", [linear, constant])
    if plan.gives_rate:
        temperature = graph.sum(graph.gather(columns, [0]), 1)
        scale = graph.stored(stored["scale"])
        s0, s1, s2 = (graph.add("Gather", [scale, graph.whole([i])], axis=0) for i in range(3))
        inner = graph.add("Add", [s1, graph.add("Mul", [temperature, s2])])
        factor = graph.add("Add", [s0, graph.add("Mul", [temperature, inner])])
        rate = graph.add("Add", [graph.add("Mul", [factor, "gyro"]), value])
        return graph.add("Sub", ["gyro", rate])
    if not plan.centres:
        return value
    drawn = _drawn_in(graph, plan, columns)
    inverse = graph.add("Reciprocal", [graph.stored(stored["widths"])])
    axis = graph.whole([1])
    seen = graph.add("Unsqueeze", [graph.gather(drawn, plan.columns), axis])
    away = graph.add("Sub", [seen, graph.stored(stored["centres"])])
    z = graph.add("Mul", [away, inverse])
    basis = graph.add("Exp", [graph.add("Neg", [graph.sum(graph.add("Mul", [z, z]), 2)])])
    weighted = graph.add("Mul", [basis, graph.stored(stored["weights"])])
    if plan.edge_columns:
        step = graph.gather(graph.add("Sub", [columns, drawn]), plan.columns)
        steps = graph.add("Mul", [graph.add("Unsqueeze", [step, axis]), inverse])
        along = graph.sum(graph.add("Mul", [z, steps]), 2)
        slope = graph.add("Sub", [graph.constant(1.0), graph.add("Add", [along, along])])
        weighted = graph.add("Mul", [weighted, slope])
    return graph.add("Add", [value, graph.sum(weighted, 1)])


def _drawn_in(graph: Graph, plan: Plan, columns: str) -> str:
    """Columns with all rates scaled down together into their trained range."""
    if not plan.edge_columns:
        return columns
    rates = graph.gather(columns, plan.edge_columns)
    low, high = graph.constant(plan.edge[0]), graph.constant(plan.edge[1])
    one, zero = graph.constant(1.0), graph.constant(0.0)
    beyond = graph.add("Or", [graph.add("Greater", [rates, high]), graph.add("Less", [rates, low])])
    bound = graph.add("Where", [graph.add("Greater", [rates, zero]), high, low])
    share = graph.add("Div", [bound, graph.add("Where", [beyond, rates, one])])
    share = graph.add("Where", [beyond, share, one])
    least = graph.add("ReduceMin", [share], axes=[1], keepdims=1)
    held = np.isin(np.arange(len(plan.names)), plan.edge_columns)
    factor = graph.add("Where", [graph.constant(held, np.bool_), least, one])
    return graph.add("Mul", [columns, factor])
