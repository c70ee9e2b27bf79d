"""Drift models on a microcontroller: bytes, instructions a sample and error, ours beside other exporters'.

``python -m experiments.benchmarks.firmware`` writes ``firmware.json`` and ``firmware.md`` beside this file.
Errors are against the truth, on runs at ramp rates that were not trained at.
Instructions are counted by ``valgrind --tool=callgrind`` on this machine (gcc -O2), as the difference
between two numbers of rounds.
"""

from __future__ import annotations

import argparse
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
from fogml.arrays import FloatArray

HERE = Path(__file__).parent
FEATURES = "T, dT, T*dT"
_ROWS = 200
_ROW_S = 20
# Seconds that a training row of the other libraries averages over: what their solvers can take.
SIZES = (8, 6, 4)
"""Centres of smaller networks, trained at that size."""
POLYNOMIALS = ("T^1..3, dT, T*dT", "T^1..5, dT, T*dT, T^2*dT, T^3*dT")
LEVELS = (1.1, 1.5, 2.5, 5.0)
"""Errors, as multiples of the network's, at which the smallest model of each exporter is told."""
_RATES, _HELD = (0.5, 1.0, 2.0), 1
# Ramp rates of the training cycles [degC/min], and the one that settings are judged on.


def main() -> int:
    """Measure, write and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--ours", action="store_true", help="other exporters stay as firmware.json has them")
    kept = parser.parse_args().ours
    world = World(noise=0.1, ripple=(0.1, 40.0))
    trained, _ = world.run(np.concatenate([cycle(rate) for rate in _RATES]), 1.0, 1, "train.csv")
    test, truth = world.run(np.concatenate([cycle(rate) for rate in (0.7, 1.5)]), 1.0, 2, "test.csv")
    case = _Case(trained, test, truth)
    machine = describe_machine()
    if kept:
        held = json.loads((HERE / "firmware.json").read_text())
        others, measured = [row for row in held["rows"] if "judged" in row], held["others_measured"]
    else:
        others, measured = case.others(), machine["date"]
    rows = [*case.ours(), *others]
    result = {
        "schema": "fogml.firmware/1",
        "machine": machine,
        "others_measured": measured,
        "features": FEATURES,
        "rows": rows,
    }
    (HERE / "firmware.json").write_text(
        json.dumps(result, indent=1, allow_nan=False) + "\n", encoding="utf-8"
    )
    page = _page(rows, machine, measured)
    (HERE / "firmware.md").write_text(page, encoding="utf-8")
    print(page)
    return 0


class _Case:
    """One unit, a training run and a test run with its truth."""

    def __init__(self, trained: Any, test: Any, truth: FloatArray) -> None:
        from fogml.models.names import make_model

        self.trained = trained
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
        """C of networks of several sizes and of polynomials, the network's graph, and a table."""
        from fogml.export.plan import Plan
        from fogml.models.names import make_model

        plans = [Plan.of(self.model)]
        for centres in SIZES:
            fitted = make_model("rbf", FEATURES, parameters={"centres": centres}).fit(self.trained)
            plans.append(Plan.of(fitted))
        polynomials = [make_model("polynomial", text).fit(self.trained) for text in POLYNOMIALS]
        rows = [self.of_plan(plan) for plan in (*plans, *map(Plan.of, polynomials))]
        return [*rows, self.onnxruntime(plans[0]), self.table()]

    def of_plan(self, plan: Any) -> dict[str, Any]:
        """Generated C of a plan."""
        from fogml.export.c_source import c_source
        from fogml.export.storage import weight_bytes

        source = c_source(plan, "float32", [])
        what = f"RBF of {plan.centres} centres" if plan.centres else f"polynomial of {len(plan.names)} terms"
        return {
            "name": f"fogml, {what}, float32",
            "error": self.error(plan.value(plan.full_columns(self.x[:, :2]))),
            "weights": weight_bytes(plan, "float32", True),
            **self.cost(source.files, "fogml_model.c", "compensate(x, true, 0.0f, &out)"),
            "flash_note": "feature windows, trained box and flags included",
        }

    def table(self) -> dict[str, Any]:
        """The segment table of the network: what it says at rest."""
        from fogml.export.segments import Segments
        from fogml.export.tables import TableSettings, export_tables

        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            report = export_tables([self.model], folder, TableSettings("segments"))["axes"]["x"]
            files = {file: (folder / file).read_text() for file in ("fogml_segments.c", "fogml_segments.h")}
            held = json.loads((folder / "fogml_segments.json").read_text())["axes"]["x"]
        knots = np.array(held["temperature_degc"])
        one = np.ones(len(knots))
        table = Segments("T", "deg/h", knots, np.array(held["bias_deg_h"]), one, 0.0, 0.0, 0.0)
        return {
            "name": f"fogml, segment table of {len(knots)} breakpoints, float32",
            "error": self.error(table.at(self.x[:, 0])[0]),
            "weights": report["bytes"],
            **self.cost(files, "fogml_segments.c", "fogml_segments(x, &zero, &out)"),
            "flash_note": "of temperature alone: the rate is left out",
        }

    def cost(self, files: dict[str, str], main: str, call: str) -> dict[str, Any]:
        """Flash of generated C, and its instructions from temperature and rate to a flagged output."""
        head = f'#include "{main}"\nstatic const float zero = 0.0f;\n'
        head += f"static float told(const float *x) {{ float out; (void)zero; (void){call}; return out; }}\n"
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for file, text in files.items():
                (folder / file).write_text(text)
            atoms = np.ascontiguousarray(self.probes[:, :2]).astype("f4")
            count = instructions(folder, head, "told(x[row])", "float", atoms, [])
            flash = cortex_bytes(folder, files[main], ["-DFOGML_NO_SELF_TEST"])
        return {"flash": flash, "instructions": count}

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


def _page(rows: list[dict[str, Any]], machine: dict[str, Any], measured: str) -> str:
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
        "machine a sample by callgrind: of fogml's from temperature and rate to the output with its flag, of",
        "the others from scaled features to scaled drift. The size and settings of emlearn's and",
        "m2cgen's models are chosen on the training run alone, fitted at 0.5 and 2 degC/min and judged at",
        f"1: the smallest that comes within {NEAR - 1.0:.0%} of the best judged. {machine['processor']}, "
        f"{machine['date']}, emlearn and m2cgen {measured}.",
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
    """At each level of error the smallest model of each exporter that keeps to it on the test run."""
    lines = [
        "Equal accuracy: the smallest model of each exporter whose error on the test run is at most so",
        "large; weights in bytes, and instructions.",
        "",
        "| error, deg/h, at most | fogml | emlearn | m2cgen |",
        "|---:|---|---|---|",
    ]
    for level in LEVELS:
        cells = []
        for name in ("fogml", "emlearn", "m2cgen"):
            near = [row for row in rows if row["name"].startswith(name) and "error" in row]
            equal = [row for row in near if row["error"] <= level * ours]
            least = min(equal, key=lambda row: row["weights"], default=None)
            cells.append("none" if least is None else _told(least))
        lines.append(f"| {level * ours:.4f} | {' | '.join(cells)} |")
    return lines


def _told(row: dict[str, Any]) -> str:
    what = row["name"].split(", ")[1]
    return f"{what}: {row['weights']:,} B, {row['instructions']:,.0f}"


if __name__ == "__main__":
    sys.exit(main())
