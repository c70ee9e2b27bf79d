"""Files of every kind hold the model, prune to a budget, and are refused where they differ."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.io import loadmat

from experiments.synthetic_world import World, cycle
from fogml.errors import InputError
from fogml.export.c_float import literal
from fogml.export.export import export_model
from fogml.export.losses import training_rows
from fogml.export.plan import Plan
from fogml.export.points import box_points, history, reached_points
from fogml.export.prune import pruned
from fogml.export.settings import ExportSettings
from fogml.export.storage import FILE_DTYPES, stored_array, weight_bytes
from fogml.features.atoms import AtomValues
from fogml.models.base import DriftModel
from fogml.models.card import TrainingRun
from fogml.models.names import make_model
from tests.export.conftest import NAMES, training_run
from tests.export.test_c_code import disturbed

needs_cc = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")


@pytest.mark.parametrize("name", NAMES)
def test_the_plain_form_is_the_model(model_of, name):
    model = model_of(name)
    plan, run = Plan.of(model), disturbed(3)
    if model.features_ is None:
        everywhere = np.ones(len(run), dtype=bool)
        atoms = AtomValues(np.empty((len(run), 0)), everywhere, everywhere)
    else:
        atoms = model.features_.atom_values(run)
    value, flag = plan.compensated(atoms, run.gyro)
    expected = model.compensate(run)
    np.testing.assert_allclose(value, expected.compensated, rtol=1e-12, atol=1e-9)
    np.testing.assert_array_equal(flag, expected.flag)


@pytest.mark.parametrize("name", ["polynomial", "rich", "rbf", "joint", "memory"])
def test_histories_go_through_the_trained_box(model_of, name):
    plan = Plan.of(model_of(name))
    past = history(plan, 0)
    _, flag = plan.compensated(past.atoms(plan), past.gyro)
    assert np.mean(flag == 0) > 0.1
    assert np.any(flag == 1) and np.any(flag == 2)


def test_memories_of_turns_settle_in_a_history() -> None:
    """At the pace of its ramps an hour's walk would not move far enough for a play of 60 degC to settle."""
    run, _ = World(noise=0.05).run(cycle(0.7, 2.0)[::2], 2.0, 1, "slow.csv")
    plan = Plan.of(make_model("polynomial", features="T_in, dT_in, play(T_in, 30 degC)").fit(run))
    for seed in range(3):
        past = history(plan, seed)
        assert np.mean(plan.compensated(past.atoms(plan), past.gyro)[1] == 0) > 0.1


@pytest.mark.parametrize("to", ["json", "mat"])
@pytest.mark.parametrize("dtype", FILE_DTYPES)
@pytest.mark.parametrize("name", ["mean", "polynomial", "rbf", "joint"])
def test_number_files_hold_the_model(model_of, tmp_path, name, to, dtype):
    report = export_model(model_of(name), tmp_path, ExportSettings(to, dtype, tolerance=1.0))
    bound = {"float64": 1e-9, "float32": 1e-4, "float16": 0.02, "int8": 0.2}[dtype]
    assert report["largest_difference"] < bound
    sizes = {"float64": 8, "float32": 4, "float16": 3, "int8": 2}
    count = sum(values.size for values in Plan.of(model_of(name)).arrays.values())
    assert report["bytes_weights"] <= sizes[dtype] * count + 64
    files = {"json": ["fogml_model.json", "fogml_model.safetensors"], "mat": ["fogml_model.mat"]}
    assert report["files"] == sorted([*files[to], "fogml_model.txt"])


@pytest.mark.parametrize("to", ["c", "json", "mat", "onnx"])
def test_the_same_export_later_has_the_same_bytes(model_of, tmp_path, monkeypatch, to):
    exports = []
    for when in ("Mon Jan  1 00:00:00 2024", "Tue Feb  6 11:12:13 2029"):
        monkeypatch.setattr("time.asctime", lambda when=when: when)
        (folder := tmp_path / when[:3]).mkdir()
        export_model(model_of("polynomial"), folder, ExportSettings(to))
        exports.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert exports[0] == exports[1]


def by_hand(held, arrays, atoms, gyro):
    """Value of a file's numbers at limited atoms (n, a), by what it says of formula, edge and composition."""
    columns = []
    for feature in held["features"]:
        value = np.ones(len(atoms)) if feature["column"] is None else columns[feature["column"]]
        columns.append(value * np.prod(atoms[:, feature["times_atoms"]], axis=1))
    f = np.column_stack(columns)
    value = arrays["constant"] + f @ arrays["linear"]
    if held["form"] == "joint":
        s = arrays["scale"]
        return (s[0] + s[1] * f[:, 0] + s[2] * f[:, 0] ** 2) * gyro + value
    if held["form"] == "linear":
        return value
    drawn = f.copy()
    for row in drawn:
        shares = [1.0]
        for low, high, k in zip(*held["edge"], held["edge_columns"]):
            if not low <= row[k] <= high:
                shares.append((high if row[k] > 0.0 else low) / row[k])
        row[held["edge_columns"]] *= min(shares)
    x, own = drawn[:, None, held["network_columns"]], f[:, None, held["network_columns"]]
    away, width = x - arrays["centres"], arrays["widths"]
    slope = 1.0 - 2.0 * np.sum(away * (own - x) / width**2, axis=2)
    return value + (np.exp(-np.sum((away / width) ** 2, axis=2)) * slope) @ arrays["weights"]


@pytest.mark.parametrize("name", ["polynomial", "memory", "rbf", "joint"])
def test_the_file_alone_is_enough_to_compute_the_drift(model_of, tmp_path, name):
    """In JSON and in MATLAB's, beyond the trained box and a network's edge, too."""
    model = model_of(name)
    plan = Plan.of(model)
    for to in ("json", "mat"):
        export_model(model, tmp_path, ExportSettings(to, "float64"))
    held = json.loads((tmp_path / "fogml_model.json").read_text())
    arrays = {array: np.array(entry["values"]) for array, entry in held["arrays"].items()}
    given = box_points(plan, 1, beyond=1.0, count=400)
    gyro = np.linspace(-9.0, 9.0, 400)
    low, high, margin = (np.array([atom[end] for atom in held["atoms"]]) for end in ("low", "high", "margin"))
    half = 0.5 * (high[0] - low[0])
    assert given[:, 0].min() < low[0] - half and given[:, 0].max() > high[0] + half
    past = np.maximum(np.maximum(given - high, low - given), 0.0)
    atoms = np.clip(given, low, high) + np.sign(given - low) * margin * past / (margin + past)
    expected = plan.value(plan.full_columns(given), gyro)
    np.testing.assert_allclose(by_hand(held, arrays, atoms, gyro), expected, atol=1e-9)
    assert {atom["operator"] for atom in held["atoms"]} == set(held["operators"])
    assert {atom["window"]["method"] for atom in held["atoms"] if atom["window"]} == set(held["windows"])
    # In MATLAB's file a feature is a product of powers, and columns count from 1.
    fields = loadmat(tmp_path / "fogml_model.mat", simplify_cells=True)["fogml"]
    for columns in ("network_columns", "edge_columns"):
        assert np.atleast_1d(fields[columns]).tolist() == [k + 1 for k in held[columns]]
    f = np.prod(atoms[:, None, :] ** np.atleast_2d(fields["powers"]), axis=2)
    np.testing.assert_allclose(f, plan.compose(atoms), rtol=1e-12)
    assert json.loads(fields["document"]) == {key: held[key] for key in json.loads(fields["document"])}


def test_operators_with_numbers_have_them_in_the_file(tmp_path):
    waves = "late_sine(T_in, 9 degC, 60 s), transition(T_in, 20 degC, 5 degC)"
    model = make_model("polynomial", features=f"T_in, {waves}, beyond(T_in, 0 degC, 9 degC)")
    export_model(model.fit(training_run()), tmp_path, ExportSettings("json"))
    held = json.loads((tmp_path / "fogml_model.json").read_text())
    given = {atom["operator"]: atom["parameters"] or atom["bounds"] for atom in held["atoms"]}
    assert given == {
        "value": None, "late_sine": [9.0, 60.0], "transition": [20.0, 5.0], "beyond": [0.0, 9.0],
    }  # fmt: skip
    assert held["operators"]["transition"] == "tanh((x - parameters[0])/parameters[1])"


@pytest.mark.parametrize("dtype", ["float64", "float32", "int8"])
@pytest.mark.parametrize("pipeline", [False, True])
@pytest.mark.parametrize("name", ["polynomial", "rich", "rbf", "joint"])
def test_onnx(model_of, tmp_path, name, pipeline, dtype):
    pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    model = model_of(name)
    if dtype == "int8" and pipeline:
        pytest.skip("the weights are those of the graph from features")
    settings = ExportSettings("onnx", dtype, tolerance=1.0, pipeline=pipeline)
    export_model(model, tmp_path, settings)
    session = runtime.InferenceSession(str(tmp_path / "fogml_model.onnx"), providers=["CPUExecutionProvider"])
    run = training_run() if name != "joint" else disturbed(4)
    plan = Plan.of(model)
    real = np.float64 if dtype == "float64" else np.float32
    names = ["drift", "flag"] if pipeline else ["drift"]
    assert [output.name for output in session.get_outputs()] == names
    if pipeline:
        entry = session.get_inputs()[0]
        assert entry.name == "temperatures"
        length = entry.shape[1]
        if length > len(run) // 2:
            pytest.skip("the exponential window looks back over the whole run")
        ends = np.arange(length, len(run), 371) if name != "joint" else np.array([520, 580])
        paths = np.column_stack([run.temperature(sensor) for sensor in plan.sensors])
        feed = {"temperatures": np.stack([paths[end - length + 1 : end + 1] for end in ends]).astype(real)}
        if name == "joint":
            pytest.skip("gaps in the run: compared by the export itself")
    else:
        ends = np.flatnonzero(model.evaluate(run).full)[::50]
        feed = {"features": model.features_.transform(run, limited=True, linear=True)[ends].astype(real)}
    if name == "joint":
        feed["gyro"] = run.gyro[ends].astype(real)
    drift, *flag = session.run(names, feed)
    if flag:
        np.testing.assert_array_equal(flag[0], model.compensate(run).flag[ends] == 1)
    bound = {"float64": 1e-8, "float32": 2e-3, "int8": 0.2}[dtype]
    np.testing.assert_allclose(drift, model.predict(run)[ends], atol=bound)


@pytest.mark.parametrize("name", ["polynomial", "rich"])
@pytest.mark.parametrize("none", [np.nan, np.inf, -127.0, 1e30])
def test_a_window_with_what_is_no_reading_is_flagged_and_ends_no_batch(model_of, tmp_path, name, none):
    pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    export_model(model_of(name), tmp_path, ExportSettings("onnx", "float32", pipeline=True))
    session = runtime.InferenceSession(str(tmp_path / "fogml_model.onnx"), providers=["CPUExecutionProvider"])
    _, length, sensors = session.get_inputs()[0].shape
    windows = np.full((5, length, sensors), 20.0, dtype=np.float32)
    sound, good = session.run(None, {"temperatures": windows})
    windows[1, -1, 0] = windows[3, length // 2, -1] = none
    drift, flag = session.run(None, {"temperatures": windows})
    assert np.isnan(drift[[1, 3]]).all() and flag[[1, 3]].tolist() == [1, 1]
    np.testing.assert_array_equal(drift[[0, 2, 4]], sound[[0, 2, 4]])
    np.testing.assert_array_equal(flag[[0, 2, 4]], good[[0, 2, 4]])


def test_a_graph_from_windows_states_what_its_weights_lose_anywhere_in_the_box(model_of, tmp_path):
    pytest.importorskip("onnxruntime")
    stated = [
        export_model(
            model_of("rbf"), tmp_path, ExportSettings("onnx", "int8", tolerance=1.0, pipeline=pipeline)
        )
        for pipeline in (False, True)
    ]
    assert stated[1]["largest_difference"] > 0.999 * stated[0]["largest_difference"]
    assert stated[1]["compared"]["points"] == stated[0]["compared"]["points"]


@needs_cc
@pytest.mark.parametrize("name", ["rbf", "rich"])
@pytest.mark.parametrize("train", [False, True])
def test_a_byte_budget_is_kept_and_more_bytes_are_no_worse(model_of, tmp_path, name, train):
    model = model_of(name)
    runs = [training_run()] if train else []
    errors = []
    for budget in (60, 120, 200) if name == "rbf" else (12, 24, 36):
        report = export_model(model, tmp_path, ExportSettings("json", "float32", budget), runs)
        assert report["bytes_weights"] <= budget
        pruning = report["pruning"]
        assert pruning["chosen_on"] == ("training runs" if train else "points in the trained box")
        assert pruning["rms_difference"] <= pruning["model_deviation"]  # a constant alone leaves that
        errors.append(report["accuracy"]["rms_exported"] if train else pruning["rms_difference"])
    assert errors == sorted(errors, reverse=True)


@pytest.mark.parametrize("share", [0.8, 0.6, 0.4])
def test_terms_of_memories_are_chosen_where_memories_get_to(model_of, share):
    """Beside the trained box alone, without the training runs, what is left on them falls by a quarter."""
    whole = Plan.of(model_of("memory"))
    rows = training_rows(model_of("memory"), whole, [training_run()])
    drift = whole.value(whole.full_columns(rows.atoms))
    left = []
    for points in (box_points(whole, 0), reached_points(whole, 0)[0]):
        columns = whole.full_columns(points)
        budget = int(share * weight_bytes(whole, "float32", True))
        fewer = pruned(whole, budget, "float32", True, columns, whole.value(columns))
        off = drift - fewer.value(fewer.full_columns(rows.atoms_of(fewer)))
        left.append(np.sqrt(np.mean(off**2)))
    assert left[1] < 0.75 * left[0]


def test_a_pruned_model_runs_in_c(model_of, tmp_path):
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    report = export_model(model_of("rbf"), tmp_path, ExportSettings("c", "float32", 150))
    assert report["bytes_weights"] <= 150
    assert report["largest_difference"] < 1e-4


def test_accuracy_on_training_folds(model_of, tmp_path):
    settings = ExportSettings("json", "int8", tolerance=1.0)
    accuracy = export_model(model_of("rbf"), tmp_path, settings, [training_run()])["accuracy"]
    assert accuracy["on"] == "training folds"
    assert len(accuracy["folds"]) == 5
    assert accuracy["rms_model"] <= accuracy["rms_exported"] < 3.0 * accuracy["rms_model"]


def test_only_training_runs_may_choose(model_of, tmp_path):
    with pytest.raises(InputError, match="not one of the runs that the model was trained on"):
        export_model(model_of("rbf"), tmp_path, ExportSettings("json"), [disturbed(1)])


REFUSED = [
    (ExportSettings("c", "int8"), "float64, float32, q31, q15"),
    (ExportSettings("json", "q15"), "for --to c"),
    (ExportSettings("exe"), "known are c, onnx, json, mat"),
    (ExportSettings("c", "float8"), "--dtype 'float8' is not known"),
    (ExportSettings("json", pipeline=True), "is for --to onnx"),
    (ExportSettings("json", budget=0), "positive"),
    (ExportSettings("json", "float32", 8), "takes 16 bytes"),
    (ExportSettings("json", "float16", tolerance=1e-9), r"differs by up to [0-9.e-]+ deg/h"),
    (ExportSettings("json", budget=150, tolerance=1e-9), "differs by up to"),
    (ExportSettings("c", sample_s=100.0), "too short"),
    (ExportSettings("c", "q31", sample_s=1e-5), "need a finer clock"),
    (ExportSettings("c", sample_s=-1.0), "sample interval"),
]


@pytest.mark.parametrize(("settings", "message"), REFUSED)
def test_refusals_say_why(model_of, tmp_path, settings, message):
    with pytest.raises(InputError, match=message):
        export_model(model_of("rbf"), tmp_path, settings)


def test_a_scale_factor_keeps_all_of_its_numbers(model_of, tmp_path):
    """Those of a joint model are few: a budget that holds them changes nothing, a smaller one is refused."""
    report = export_model(model_of("joint"), tmp_path, ExportSettings("json", budget=1000))
    assert "pruning" not in report and report["bytes_weights"] <= 1000
    with pytest.raises(InputError, match="has none to leave out"):
        export_model(model_of("joint"), tmp_path, ExportSettings("json", budget=20))


SCIKIT_LEARN = [
    ("sklearn.linear_model.Ridge", {}),
    ("sklearn.cross_decomposition.PLSRegression", {"n_components": 2}),
    ("sklearn.svm.SVR", {"kernel": "linear"}),
    ("sklearn.svm.SVR", {"C": 10.0}),
    ("sklearn.svm.NuSVR", {"gamma": 0.3}),
    ("sklearn.kernel_ridge.KernelRidge", {"kernel": "rbf"}),
    ("sklearn.gaussian_process.GaussianProcessRegressor", {"optimizer": None}),
]


@cache
def of_scikit_learn(name: str, parameters: tuple[tuple[str, object], ...]) -> DriftModel:
    model = make_model(name, "T, dT, T*dT", parameters=dict(parameters))
    model.max_rows = 120
    return model.fit(training_run())


@pytest.mark.parametrize(("name", "parameters"), SCIKIT_LEARN)
def test_linear_models_and_gaussian_kernels_have_the_compact_form(name, parameters):
    model, run = of_scikit_learn(name, tuple(parameters.items())), disturbed(3)
    value, flag = Plan.of(model).compensated(model.features_.atom_values(run), run.gyro)
    expected = model.compensate(run)
    np.testing.assert_allclose(value, expected.compensated, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(flag, expected.flag)


@needs_cc
def test_support_vectors_run_in_c(tmp_path):
    model = of_scikit_learn("sklearn.svm.SVR", (("C", 10.0),))
    report = export_model(model, tmp_path, ExportSettings("c"))
    assert report["model"]["centres"] == len(model.regressor_.regressor_[-1].support_)
    assert report["compared"]["flags_differ"] == 0


def test_running_a_graph_leaves_nothing_in_the_home_folder(tmp_path):
    """onnxruntime keeps an identity of the machine there, for what it tells its maker."""
    pytest.importorskip("onnxruntime")
    onnx = pytest.importorskip("onnx")
    held = onnx.helper.make_tensor_value_info("x", onnx.TensorProto.FLOAT, [1])
    told = onnx.helper.make_tensor_value_info("y", onnx.TensorProto.FLOAT, [1])
    graph = onnx.helper.make_graph([onnx.helper.make_node("Identity", ["x"], ["y"])], "g", [held], [told])
    opset = onnx.helper.make_opsetid("", 17)
    onnx.save(onnx.helper.make_model(graph, opset_imports=[opset], ir_version=8), tmp_path / "g.onnx")
    (tmp_path / "home").mkdir()
    code = (
        "import sys; from fogml.export.onnx_graph import session_of as of; of(open(sys.argv[1], 'rb').read())"
    )
    environment = {name: value for name, value in os.environ.items() if name != "ORT_DISABLE_TELEMETRY"}
    environment |= {"HOME": str(tmp_path / "home"), "XDG_CACHE_HOME": ""}
    subprocess.run([sys.executable, "-c", code, tmp_path / "g.onnx"], check=True, env=environment)
    assert not list((tmp_path / "home").rglob("*"))


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("sklearn.tree.DecisionTreeRegressor", {"max_depth": 4}),
        ("sklearn.neural_network.MLPRegressor", {"hidden_layer_sizes": (4,), "solver": "lbfgs"}),
        ("sklearn.svm.SVR", {"kernel": "poly"}),
    ],
)
def test_what_has_no_compact_form_is_a_graph_alone(tmp_path, name, parameters):
    pytest.importorskip("skl2onnx")
    runtime = pytest.importorskip("onnxruntime")
    model = of_scikit_learn(name, tuple(parameters.items()))
    for to in ("c", "json", "mat"):
        with pytest.raises(InputError, match=r"no compact form.*--to onnx"):
            export_model(model, tmp_path, ExportSettings(to))
    with pytest.raises(InputError, match="--with-pipeline is not for"):
        export_model(model, tmp_path, ExportSettings("onnx", pipeline=True))
    report = export_model(model, tmp_path, ExportSettings("onnx"))
    assert report["files"] == ["fogml_model.onnx"]
    session = runtime.InferenceSession(str(tmp_path / "fogml_model.onnx"), providers=["CPUExecutionProvider"])
    run = disturbed(3)
    columns = model.features_.transform(run, limited=True).astype(np.float32)
    (drift,) = session.run(["drift"], {"features": columns})
    off = np.abs(drift - model.predict(run))
    # A value at a threshold of a tree may fall on its other side in float32.
    assert np.quantile(off, 0.99) < 1e-4


@pytest.mark.parametrize("dtype", ["float16", "int8"])
def test_small_formats_keep_numbers_of_any_size(dtype):
    values = np.array([4e-7, -3e-5, 0.0, 1.0, 2e5])
    decoded = stored_array("linear", values, dtype).decoded
    np.testing.assert_allclose(decoded, values, rtol=1e-3 if dtype == "float16" else 1e-2)


@needs_cc
def test_foreign_text_stays_a_comment_of_c(model_of, tmp_path):
    calls = '__attribute__((constructor)) void z(void) { system("touch ran"); }'
    hostile = f"*/\nint system(const char *);\n{calls}\n/*"
    model = copy(model_of("polynomial"))
    runs = (TrainingRun(hostile, hostile),)
    model.card_ = replace(model.card_, unit=hostile, axis="x\\", runs=runs, fogml_version=hostile)
    model.kind = hostile
    export_model(model, tmp_path, ExportSettings("c"))
    for name in ("fogml_model.h", "fogml_model.c"):
        text = (tmp_path / name).read_text(encoding="ascii")
        bare = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        assert "system" not in bare and "constructor" not in bare and "system" in text


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_a_number_that_a_type_does_not_hold_is_told(value):
    with pytest.raises(InputError, match="float32 does not hold"):
        literal(value, "float32")


@pytest.mark.parametrize("sample_s", [0.0, -1.0, 1e-300, 1e308, np.inf, np.nan])
def test_a_sample_interval_that_no_unit_has_is_refused(sample_s: float) -> None:
    model = make_model("polynomial", "T").fit([training_run()])
    with pytest.raises(InputError, match=r"a sample interval of .* s; state one of 1e-06 to 86400 s"):
        Plan.of(model, sample_s)
