"""A plan as JSON beside safetensors, or as a MATLAB file, and back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml import json_files
from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.export.plan import Plan
from fogml.export.storage import Stored, arrays_to_write
from fogml.features.atoms import DEAD_BAND
from fogml.features.operators import REACH, TAKEN, Window
from fogml.runs.column_files import take_out_date
from fogml.strict import as_written

SCHEMA = "fogml.weights/1"
JSON_FILE, TENSORS_FILE, MAT_FILE = "fogml_model.json", "fogml_model.safetensors", "fogml_model.mat"
FORMULAS = {
    "constant": "drift = constant",
    "linear": "drift = constant + sum_k linear[k] f[k]",
    "network": "drift = constant + sum_k linear[k] f[k] + sum_j weights[j] exp(-sum_d ((x[d] - "
    "centres[j][d]) / widths[j][d])^2), x = f[network_columns]; beyond 'edge' along the slope there",
    "joint": "compensated = (scale[0] + scale[1] T + scale[2] T^2) gyro + constant + sum_k linear[k] f[k], "
    "T = f[0]",
}
EDGE = (
    "where some f of edge_columns lie beyond edge, its rows low and high, all of those columns are "
    "multiplied by the least edge / f (of high where f > 0, else of low) before x is taken of them, and "
    "exp(...) is multiplied by 1 - 2 sum_d (x[d] - centres[j][d]) (f[network_columns][d] - x[d]) / "
    "widths[j][d]^2; linear takes f as it was"
)
"""What a network does beyond its edge."""
COMPOSITION = (
    "f[k] is the product of its times_atoms, limited, and of f[column] unless column is null; in MATLAB, "
    "f(k) is the product over a of atom(a)^powers(k,a); places here count from 0"
)
PACKING = (
    "an array with a NAME_exponent stands for NAME 2^NAME_exponent, by its last index; uint16 in "
    "MATLAB's file are the bits of half precision"
)
OPERATORS = {
    "value": "x, the sum of weight times column over signal; T, where a run has none, is T_in, or the "
    "mean of its inner sensors",
    "diff": "difference of x by its window",
    "d": "rate of x per minute by its window",
    "sign": f"1, 0 or -1: the rate of x per minute by its window is above {DEAD_BAND}, within, below "
    f"-{DEAD_BAND}",
    "lag": "y of memory dy/dt = x - y, x straight between samples, memory in s; y = x at the first sample "
    "and after a gap longer than a quarter of memory and three sample_s",
    "play": "y = min(max(y, x - memory), x + memory); x at the first sample",
    "since_on": "exp(-max(x, 0)/memory), x in s since power-on",
    "beyond": f"e = x beyond bounds, either way, as m e/(m + e) - k e/(k + e), m and k being {REACH:g} and "
    f"{TAKEN:g} of the bounds' distance; 0 between them",
    "sine": "sin(2 pi x/parameters[0])",
    "cosine": "cos(2 pi x/parameters[0])",
    "late_sine": "sine of x behind a lag whose memory is parameters[1]",
    "late_cosine": "cosine of x behind a lag whose memory is parameters[1]",
    "transition": "tanh((x - parameters[0])/parameters[1])",
}
"""What atoms are, by their operator; others are of one's own."""
WINDOWS = {
    "block": "mean of x over ages below length_s less that over the length_s before; a rate is that over the "
    "distance of their mean times",
    "slope": "least-squares line through x over ages below length_s; a difference is its rise over length_s",
    "exp": "r grows by (1 - exp(-dt/length_s)) ((x - last)/dt - r) with each sample, 0 at first; a "
    "difference is r length_s",
    "first": "x less the sample before; a rate is that over their distance",
}
"""How a full window makes a difference or a rate, by its method."""
KERNEL = (
    "sum w x/sum w t over ages below length_s, w being weights, straight between equal steps of age, less "
    "their mean, and t the times; a difference is that times length_s"
)
"""The same of a window of one's own."""
LIMITING = (
    "an atom e beyond low or high becomes margin e/(margin + e) beyond it; below flag_below or above "
    "flag_above a sample is flagged 1, outside training; so is one at which an input of slices, an atom less "
    "another, is below low or above high of the slice floor((of - first)/width), the last one at most"
)


def write_json(
    folder: Path, plan: Plan, stored: Mapping[str, Stored], dtype: str, card: Mapping[str, Any]
) -> None:
    """Write `JSON_FILE`, everything in words and numbers, and `TENSORS_FILE`, the numbers packed."""
    from safetensors.numpy import save

    arrays = arrays_to_write(stored, plan, dtype)
    document = {**_document(plan), "dtype": dtype, "card": dict(card)}
    document["arrays"] = {
        name: {"shape": list(array.values.shape), "values": array.decoded.tolist()}
        for name, array in stored.items()
    }
    json_files.write_json(folder / JSON_FILE, document, indent=1)
    packed = save({name: np.ascontiguousarray(array) for name, array in arrays.items()})
    (folder / TENSORS_FILE).write_bytes(packed)


def read_json(folder: Path, plan: Plan) -> tuple[Plan, Plan]:
    """The plan with the numbers of the JSON file, and with those of the safetensors file."""
    from safetensors.numpy import load_file

    document = json_files.read_json(folder / JSON_FILE, "export again", most_bytes=1 << 30)
    plain = {
        name: np.array(entry["values"]).reshape(entry["shape"]) for name, entry in document["arrays"].items()
    }
    return plan.with_arrays(plain), plan.with_arrays(_decoded(load_file(folder / TENSORS_FILE), plan))


def write_mat(
    folder: Path, plan: Plan, stored: Mapping[str, Stored], dtype: str, card: Mapping[str, Any]
) -> None:
    """Write `MAT_FILE`: a struct ``fogml`` with numbers, columns (from 1), box and formula.

    MATLAB has no half precision in its files: ``float16`` stands there as its bits, uint16.
    """
    from scipy.io import savemat

    document = _document(plan)
    arrays = {
        name: array.view(np.uint16) if array.dtype == np.float16 else array
        for name, array in arrays_to_write(stored, plan, dtype).items()
    }
    limits = plan.limits
    fields: dict[str, Any] = {
        **{
            name: document[name]
            for name in ("schema", "kind", "form", "formula", "limiting", "unit", "gyro_unit")
        },
        "dtype": dtype,
        "sample_s": plan.sample_s,
        "sensors": _cells(plan.sensors),
        "atoms": _cells([atom.text for atom in plan.atoms]),
        "features": _cells(plan.names),
        "network_columns": np.array(plan.columns, dtype=np.float64) + 1.0,
        "edge_columns": np.array(plan.edge_columns, dtype=np.float64) + 1.0,
        "low": limits.low,
        "high": limits.high,
        "margin": limits.margin,
        "flag_below": limits.inner,
        "flag_above": limits.outer,
        "powers": _powers(plan),
        "slices": json.dumps(_slices(plan)),
        "document": json.dumps(document),
        "card": json.dumps(dict(card), ensure_ascii=False),
        "arrays": arrays,
    }
    savemat(folder / MAT_FILE, {"fogml": fields}, oned_as="row")
    take_out_date(folder / MAT_FILE)


def read_mat(folder: Path, plan: Plan) -> Plan:
    """The plan with the numbers of the MATLAB file."""
    from scipy.io import loadmat

    fields = loadmat(folder / MAT_FILE, simplify_cells=True)["fogml"]["arrays"]
    arrays = {name: np.asarray(array) for name, array in fields.items()}
    arrays = {name: a.view(np.float16) if a.dtype == np.uint16 else a for name, a in arrays.items()}
    return plan.with_arrays(_decoded(arrays, plan))


def _decoded(arrays: Mapping[str, NDArray[Any]], plan: Plan) -> dict[str, FloatArray]:
    """Numbers from packed arrays, in the plan's shapes."""
    found = {}
    for name, like in plan.arrays.items():
        if name not in arrays:
            raise InputError(f"export: array '{name}' is missing from the file")
        exponent = arrays.get(f"{name}_exponent")
        values = np.asarray(arrays[name]).reshape(like.shape)
        held = None if exponent is None else np.asarray(exponent).reshape(-1)
        found[name] = Stored(values, held).decoded
    return found


def formula_of(plan: Plan) -> tuple[str, str]:
    """What files call the form of a plan, and its formula."""
    if plan.gives_rate:
        form = "joint"
    else:
        form = "network" if plan.centres else "linear" if plan.names else "constant"
    return form, FORMULAS[form]


def _document(plan: Plan) -> dict[str, Any]:
    limits = plan.limits
    form, formula = formula_of(plan)
    used = dict.fromkeys(atom.operator for atom in plan.atoms)
    methods = dict.fromkeys(atom.window.method for atom in plan.atoms if atom.window)
    atoms = [
        {
            "text": atom.text,
            "operator": atom.operator,
            "signal": dict(atom.signal.parts),
            "window": None if atom.window is None else _window(atom.window),
            "memory": atom.memory or None,
            "bounds": None if atom.bounds is None else list(atom.bounds),
            "parameters": list(atom.parameters),
            "unit": atom.unit,
            "low": limits.low[i],
            "high": limits.high[i],
            "margin": limits.margin[i],
            "flag_below": limits.inner[i],
            "flag_above": limits.outer[i],
        }
        for i, atom in enumerate(plan.atoms)
    ]
    columns = [
        {"name": name, "column": step.column, "times_atoms": list(step.atoms)}
        for name, step in zip(plan.names, plan.steps)
    ]
    return {
        "schema": SCHEMA,
        "kind": plan.kind,
        "form": form,
        "formula": formula,
        **({"edge_rule": EDGE} if plan.edge_columns else {}),
        "composition": COMPOSITION,
        "limiting": LIMITING,
        "packing": PACKING,
        "operators": {name: OPERATORS.get(name, "one's own, as declared") for name in used},
        "windows": {name: WINDOWS.get(name, KERNEL) for name in methods},
        "unit": "deg/h",
        "gyro_unit": plan.gyro_unit,
        "sample_s": plan.sample_s,
        "sensors": list(plan.sensors),
        "atoms": atoms,
        "features": columns,
        "network_columns": list(plan.columns),
        "edge_columns": list(plan.edge_columns),
        "edge": plan.edge.tolist(),
        "slices": _slices(plan),
    }


def _window(window: Window) -> dict[str, Any]:
    own = {} if window.own is None else {"weights": list(window.own.weights)}
    return {"method": window.method, "length_s": window.length_s, **own}


def _powers(plan: Plan) -> FloatArray:
    """Power of each atom in each feature, shape (k, a)."""
    powers = np.zeros((len(plan.steps), len(plan.atoms)))
    for row, step in zip(powers, plan.steps, strict=True):
        row += 0.0 if step.column is None else powers[step.column]
        np.add.at(row, list(step.atoms), 1.0)
    return powers


def _slices(plan: Plan) -> dict[str, Any] | None:
    """Trained ranges at each temperature, beyond which a sample is flagged, atoms by name."""
    slices = plan.limits.slices
    if slices is None:
        return None
    low, high = slices.bounds
    return as_written(replace(slices, low=low, high=high).saved(plan.atoms))


def _cells(words: Any) -> NDArray[np.object_]:
    """Words as a MATLAB cell array."""
    return np.array([*words], dtype=object)
