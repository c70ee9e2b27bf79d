"""Drift models on a microcontroller: bytes, instructions a sample and error, ours beside other exporters'.

``python -m experiments.benchmarks.firmware`` writes ``firmware.json`` and ``firmware.md`` beside this file.
emlearn's multilayer perceptron and m2cgen's support vector regression are made as large as they
need be to come near our error against the truth, on runs at ramp rates that were not trained at.
Instructions are counted by ``valgrind --tool=callgrind`` on this machine (gcc -O2), from features
to drift, as the difference between two numbers of rounds.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.benchmarks.machine import describe_machine
from experiments.synthetic_world import World, cycle

FloatArray = NDArray[np.float64]
HERE = Path(__file__).parent
FEATURES = "T, dT, T*dT"
_ROWS = 200
_ROUNDS = (2, 12)
_MAIN = """
#include <stdio.h>
#include <stdlib.h>
int main(int count, char **words)
{
    static NUMBER x[ROWS][INPUTS];
    double sum = 0.0;
    int rounds = atoi(words[1]);
    if (count < 2 || fread(x, sizeof x, 1, stdin) != 1) return 2;
    for (int round = 0; round < rounds; round++)
        for (int row = 0; row < ROWS; row++) sum += (double)CALL;
    printf("%g\\n", sum);
    return 0;
}
"""


def instructions(
    folder: Path, head: str, call: str, number: str, rows: NDArray[Any], more: list[str]
) -> float | None:
    """Instructions of one call, or None without valgrind."""
    if shutil.which("valgrind") is None:
        return None
    source = _MAIN.replace("NUMBER", number).replace("CALL", call)
    source = source.replace("ROWS", str(len(rows))).replace("INPUTS", str(rows.shape[1]))
    (folder / "main.c").write_text(head + source)
    words = ["gcc", "-std=gnu99", "-O2", "-ffp-contract=off", "-w", *more, "main.c", "-o", "main", "-lm"]
    subprocess.run(words, check=True, cwd=folder)
    counts = []
    for rounds in _ROUNDS:
        tool = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "./main", str(rounds)]
        told = subprocess.run(tool, input=rows.tobytes(), capture_output=True, cwd=folder, check=True)
        counts.append(int(re.search(rb"Collected : (\d+)", told.stderr)[1]))  # type: ignore[index]
    return (counts[1] - counts[0]) / (_ROUNDS[1] - _ROUNDS[0]) / len(rows)


def cortex_bytes(folder: Path, source: str, more: list[str]) -> int | None:
    """Flash [bytes] of a source on a Cortex-M4, the C library's own functions apart."""
    if shutil.which("arm-none-eabi-gcc") is None:
        return None
    from fogml.export.c_program import CORTEX_M4

    (folder / "size.c").write_text(source)
    words = [
        "arm-none-eabi-gcc",
        *CORTEX_M4,
        "-std=gnu99",
        "-Os",
        "-w",
        *more,
        "-c",
        "size.c",
        "-o",
        "size.o",
    ]
    subprocess.run(words, check=True, cwd=folder)
    told = subprocess.run(
        ["arm-none-eabi-size", "size.o"], capture_output=True, text=True, cwd=folder, check=True
    )
    text, data, _ = (int(word) for word in told.stdout.splitlines()[1].split()[:3])
    return text + data


def main() -> int:
    """Measure, write and print."""
    world = World(noise=0.1, ripple=(0.1, 40.0))
    trained, _ = world.run(np.concatenate([cycle(rate) for rate in (0.5, 1.0, 2.0)]), 1.0, 1, "train.csv")
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
        self.x_train = features.transform(trained)[fitted]
        self.y_train = trained.error_deg_h[fitted]
        # Averages of 20 s: what other libraries' solvers can take.
        count = len(self.y_train) // 20 * 20
        self.x_train = self.x_train[:count].reshape(-1, 20, 3).mean(axis=1)
        self.y_train = self.y_train[:count].reshape(-1, 20).mean(axis=1)
        self.rows = np.ascontiguousarray(self.x[:: len(self.x) // _ROWS][:_ROWS])
        self.shift, self.scale = self.x_train.mean(axis=0), self.x_train.std(axis=0)

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
                    self.rows.astype("f4"),
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
        """emlearn's perceptron and m2cgen's support vectors, each grown until the error is near ours."""
        wanted = 1.5 * self.error(self.model.regressor_.predict_unchecked(self.x))  # type: ignore[attr-defined]
        return [
            self._guarded("emlearn", self._emlearn, wanted),
            self._guarded("m2cgen", self._m2cgen, wanted),
        ]

    @staticmethod
    def _guarded(name: str, work: Callable[[float], dict[str, Any]], wanted: float) -> dict[str, Any]:
        try:
            return work(wanted)
        except ImportError as error:
            return {"name": name, "not_measured": f"not installed: {error.name}"}

    def _emlearn(self, wanted: float) -> dict[str, Any]:
        import emlearn
        from sklearn.neural_network import MLPRegressor

        inputs = (self.x_train - self.shift) / self.scale
        best: tuple[float, int, Any] | None = None
        for size in (4, 8, 16, 32, 64):
            network = MLPRegressor(
                hidden_layer_sizes=(size,),
                activation="tanh",
                solver="lbfgs",
                max_iter=3000,
                alpha=1e-4,
                random_state=0,
            )
            network.fit(inputs, self.y_train)
            error = self.error(network.predict((self.x - self.shift) / self.scale))
            if best is None or error < best[0]:
                best = error, size, network
            if error <= wanted:
                break
        assert best is not None
        error, size, network = best
        converted = emlearn.convert(network, method="inline", dtype="float")
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            converted.save(file=str(folder / "mlp.h"), name="mlp")
            text = (folder / "mlp.h").read_text()
            call = next(
                (f for f in ("mlp_regress1", "mlp_predict") if re.search(rf"\b{f}\s*\(", text)),
                "mlp_regress1",
            )
            include = ["-I", str(Path(emlearn.__file__).parent), f"-I{emlearn.includedir}"]
            rows = ((self.rows - self.shift) / self.scale).astype("f4")
            head = '#include "mlp.h"\n'
            count = instructions(folder, head, f"{call}(x[row], {rows.shape[1]})", "float", rows, include)
            probe = f"{head}float probe(const float *x) {{ return {call}(x, {rows.shape[1]}); }}\n"
            flash = cortex_bytes(folder, probe, include)
        weights = 4 * sum(w.size for w in (*network.coefs_, *network.intercepts_))
        return {
            "name": f"emlearn, perceptron of {size} tanh, float32",
            "error": error,
            "weights": weights,
            "flash": flash,
            "flash_note": "from features; tanhf of the C library apart",
            "instructions": count,
        }

    def _m2cgen(self, wanted: float) -> dict[str, Any]:
        import m2cgen
        from sklearn.svm import SVR

        inputs = (self.x_train - self.shift) / self.scale
        best: tuple[float, Any] | None = None
        for tube in (0.1, 0.05, 0.02):
            for gamma in (0.1, 0.3, 1.0):
                machine = SVR(C=30.0, epsilon=tube, gamma=gamma).fit(inputs[::2], self.y_train[::2])
                error = self.error(machine.predict((self.x - self.shift) / self.scale))
                if best is None or error < best[0]:
                    best = error, machine
            if best is not None and best[0] <= wanted:
                break
        assert best is not None
        error, machine = best
        text = m2cgen.export_to_c(machine)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            count = instructions(
                folder, text, "score(x[row])", "double", (self.rows - self.shift) / self.scale, []
            )
            flash = cortex_bytes(folder, text, [])
        return {
            "name": f"m2cgen, {len(machine.dual_coef_[0])} support vectors, float64",
            "error": error,
            "weights": 8 * (machine.support_vectors_.size + machine.dual_coef_.size + 1),
            "flash": flash,
            "flash_note": "from features; exp of the C library apart",
            "instructions": count,
        }


def _page(rows: list[dict[str, Any]], machine: dict[str, Any]) -> str:
    def cell(value: float | None) -> str:
        return "not measured" if value is None else f"{value:,.0f}"

    lines = [
        "# Drift models on a microcontroller",
        "",
        "**Synthetic** unit (experiments/synthetic_world.py), trained at 0.5, 1 and 2 degC/min, judged at",
        "0.7 and 1.5 degC/min; error is the rms against the noise-free truth, sample by sample, features",
        "limited to the trained box. Weights and flash (Cortex-M4, -Os) in bytes; instructions of this",
        "machine a sample, from features to drift, by callgrind. emlearn's and m2cgen's models are grown",
        "until their error is within half of ours; where none of the sizes and settings tried gets there,",
        f"the best of them is shown. {machine['processor']}, {machine['date']}.",
        "",
        "| exporter and model | error, deg/h | weights | flash | instructions | |",
        "|---|---:|---:|---:|---:|---|",
    ]
    for row in rows:
        if "not_measured" in row:
            lines.append(f"| {row['name']} | | | | | {row['not_measured']} |")
            continue
        sizes = " | ".join(cell(row[key]) for key in ("weights", "flash", "instructions"))
        lines.append(f"| {row['name']} | {row['error']:.4f} | {sizes} | {row['flash_note']} |")
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    sys.exit(main())
