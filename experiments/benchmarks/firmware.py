"""Drift models on a microcontroller: bytes, instructions a sample and error, ours beside other exporters'.

``python -m experiments.benchmarks.firmware`` writes ``firmware.json`` and ``firmware.md`` beside this file.
Errors are against the truth, on runs at ramp rates that were not trained at.
Instructions are counted by ``valgrind --tool=callgrind`` on this machine (gcc -O2), from features
to drift, as the difference between two numbers of rounds.
"""

from __future__ import annotations

import importlib
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.benchmarks.firmware_cost import cortex_bytes, instructions
from experiments.benchmarks.firmware_peers import (
    NEAR,
    Rows,
    emlearn_cost,
    m2cgen_cost,
    perceptrons,
    smallest,
    support_vectors,
    weight_bytes,
)
from experiments.benchmarks.machine import describe_machine
from experiments.synthetic_world import World, cycle

FloatArray = NDArray[np.float64]
HERE = Path(__file__).parent
FEATURES = "T, dT, T*dT"
_ROWS = 200
_ROW_S = 20
# Seconds that a training row of the other libraries averages over: what their solvers can take.
EQUAL = 1.1
"""Ratio of errors within which models are called as accurate."""
_RATES, _HELD = (0.5, 1.0, 2.0), 1
# Ramp rates of the training cycles [degC/min], and the one that settings are judged on.


def main() -> int:
    """Measure, write and print."""
    world = World(noise=0.1, ripple=(0.1, 40.0))
    trained, _ = world.run(np.concatenate([cycle(rate) for rate in _RATES]), 1.0, 1, "train.csv")
    test, truth = world.run(np.concatenate([cycle(rate) for rate in (0.7, 1.5)]), 1.0, 2, "test.csv")
    case = _Case(trained, test, truth)
    rows = [*case.ours(), *case.others()]
    result = {"schema": "fogml.firmware/1", "machine": describe_machine(), "features": FEATURES, "rows": rows}
    (HERE / "firmware.json").write_text(
        json.dumps(result, indent=1, allow_nan=False) + "\n", encoding="utf-8"
    )
    page = _page(rows, result["machine"])
    (HERE / "firmware.md").write_text(page, encoding="utf-8")
    print(page)
    return 0


class _Case:
    """One unit, a training run and a test run with its truth."""

    def __init__(self, trained: Any, test: Any, truth: FloatArray) -> None:
        from fogml.models.names import make_model

        self.model = make_model("rbf", FEATURES).fit(trained)
        features = self.model.features_
        assert features is not None
        self.full = features.atom_values(test)[1]
        self.x = features.transform(test, limited=True)[self.full]
        self.truth = truth[self.full]
        fitted = features.atom_values(trained)[1]
        lengths = [len(cycle(rate)) for rate in _RATES]
        cycles = np.repeat(np.arange(len(_RATES)), lengths)
        single = Rows(
            features.transform(trained)[fitted], trained.error_deg_h[fitted], cycles[fitted] == _HELD, 1
        )
        self.rows = single.averaged(_ROW_S)
        self.probes = np.ascontiguousarray(self.x[:: len(self.x) // _ROWS][:_ROWS])

    def error(self, drift: NDArray[Any]) -> float:
        """Root mean square against the noise-free truth [deg/h]."""
        return float(np.sqrt(np.mean((np.asarray(drift, dtype=np.float64) - self.truth) ** 2)))

    def ours(self) -> list[dict[str, Any]]:
        """C of the network, whole and pruned, and the same graph in onnxruntime."""
        from fogml.export.c_source import c_source
        from fogml.export.plan import Plan
        from fogml.export.points import box_points
        from fogml.export.prune import pruned
        from fogml.export.storage import weight_bytes

        whole = Plan.of(self.model)
        points = whole.compose(box_points(whole, 0))
        rows = []
        for budget in (None, 512, 256):
            plan = whole
            if budget is not None:
                plan = pruned(whole, budget, "float32", True, points, whole.value(points))
                if plan is whole:
                    continue
            source = c_source(plan, "float32", [])
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                for file, text in source.files.items():
                    (folder / file).write_text(text)
                count = instructions(
                    folder,
                    '#include "fogml_model.c"\n',
                    "drift_of(x[row])",
                    "float",
                    self.probes.astype("f4"),
                    [],
                )
                text = source.files["fogml_model.c"]
                flash = cortex_bytes(folder, text, ["-DFOGML_NO_SELF_TEST"])
            rows.append(
                {
                    "name": f"fogml, RBF of {plan.centres} centres, float32 C",
                    "error": self.error(plan.value(self.x)),
                    "weights": weight_bytes(plan, "float32", True),
                    "flash": flash,
                    "flash_note": "feature windows, trained box and flags included",
                    "instructions": count,
                }
            )
        return [*rows, self.onnxruntime(whole)]

    def onnxruntime(self, plan: Any) -> dict[str, Any]:
        """The same network as an ONNX graph."""
        import onnxruntime

        from fogml.export.onnx_graph import onnx_model
        from fogml.export.storage import stored_plan

        stored, _ = stored_plan(plan, "float32", self.x)
        data = onnx_model(plan, stored, "float32", False, "").SerializeToString()
        session = onnxruntime.InferenceSession(data, providers=["CPUExecutionProvider"])
        drift = session.run(["drift"], {"features": self.x.astype(np.float32)})[0]
        library = max((p.stat().st_size for p in Path(onnxruntime.__file__).parent.rglob("*.so*")), default=0)
        return {
            "name": "onnxruntime, the same network, float32",
            "error": self.error(drift),
            "weights": len(data),
            "flash": None,
            "flash_note": f"the runtime's library is {library / 2**20:.0f} MiB; none for a microcontroller",
            "instructions": None,
        }

    def others(self) -> list[dict[str, Any]]:
        """emlearn's perceptron and m2cgen's support vectors: the one shown, and error against bytes."""
        kinds = (
            ("emlearn", perceptrons, emlearn_cost, "perceptron of {} tanh, float32", "tanhf"),
            ("m2cgen", support_vectors, m2cgen_cost, "{} support vectors, float64", "exp"),
        )
        rows: list[dict[str, Any]] = []
        for name, grow, cost, words, function in kinds:
            try:
                importlib.import_module(name)
            except ImportError as error:
                rows.append({"name": name, "not_measured": f"not installed: {error.name}"})
                continue
            began = time.process_time()
            found = grow(self.rows)
            took_s = time.process_time() - began
            chosen = smallest(found)
            for fitted in sorted(found, key=lambda one: one.size):
                rows.append(
                    {
                        "name": f"{name}, {words.format(fitted.size)}",
                        "chosen": fitted is chosen,
                        "judged": fitted.judged,
                        "error": self.error(fitted.drift(self.x)),
                        "weights": weight_bytes(fitted.model),
                        **cost(fitted, self.probes),
                        "flash_note": f"from scaled features; {function} of the C library apart; tuning and "
                        f"training of all sizes {took_s:.0f} s of processor time",
                    }
                )
        return rows


def _page(rows: list[dict[str, Any]], machine: dict[str, Any]) -> str:
    def cell(value: float | None) -> str:
        return "not measured" if value is None else f"{value:,.0f}"

    head = [
        "| exporter and model | error, deg/h | weights | flash | instructions | |",
        "|---|---:|---:|---:|---:|---|",
    ]
    ours = next(row["error"] for row in rows)
    lines = [
        "# Drift models on a microcontroller",
        "",
        "**Synthetic** unit (experiments/synthetic_world.py), trained at 0.5, 1 and 2 degC/min, judged at",
        "0.7 and 1.5 degC/min; error is the rms against the noise-free truth, sample by sample, features",
        "limited to the trained box. Weights and flash (Cortex-M4, -Os) in bytes; instructions of this",
        "machine a sample, from features to drift, by callgrind. The size and settings of emlearn's and",
        "m2cgen's models are chosen on the training run alone, fitted at 0.5 and 2 degC/min and judged at",
        f"1: the smallest that comes within {NEAR - 1.0:.0%} of the best judged. {machine['processor']}, "
        f"{machine['date']}.",
        "(`python -m experiments.benchmarks.firmware`)",
        "",
        *head,
    ]
    for row in rows:
        if "not_measured" in row:
            lines.append(f"| {row['name']} | | | | | {row['not_measured']} |")
        elif row.get("chosen", True):
            sizes = " | ".join(cell(row[key]) for key in ("weights", "flash", "instructions"))
            lines.append(f"| {row['name']} | {row['error']:.4f} | {sizes} | {row['flash_note']} |")
    lines += [
        "",
        "Error against bytes, each size with its best settings; judged is the rms of 120 s averages of what",
        "is left of the noisy cycle that settings were judged on.",
        "",
        "| exporter and model | judged, deg/h | error, deg/h | over ours | weights | flash | instructions |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for row in rows:
        if "judged" in row:
            sizes = " | ".join(cell(row[key]) for key in ("weights", "flash", "instructions"))
            errors = f"{row['judged']:.5f} | {row['error']:.4f} | {row['error'] / ours:.2f}"
            lines.append(f"| {row['name']} | {errors} | {sizes} |")
    return "\n".join([*lines, "", *_equal(rows, ours), ""])


def _equal(rows: list[dict[str, Any]], ours: float) -> list[str]:
    """Of each other exporter the smallest model that is as accurate as ours on the test run."""
    said = []
    for name in ("emlearn", "m2cgen"):
        near = [row for row in rows if "judged" in row and row["name"].startswith(name)]
        equal = [row for row in near if row["error"] <= EQUAL * ours]
        if equal:
            least = min(equal, key=lambda row: row["weights"])
            said.append(
                f"- {name}: the smallest of these within {EQUAL - 1.0:.0%} of our error on the test run is "
                f"`{least['name']}`, {least['weights']:,} bytes of weights."
            )
        elif near:
            best = min(near, key=lambda row: row["error"])
            said.append(f"- {name}: none comes within {EQUAL - 1.0:.0%}; nearest is `{best['name']}`.")
    return said


if __name__ == "__main__":
    sys.exit(main())
