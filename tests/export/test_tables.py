"""Tables and cubics over temperature: against brute force, constant temperatures, autopilots' formulas."""

from __future__ import annotations

import csv
import itertools
import json
import re
import shutil
import subprocess

import numpy as np
import pytest
import yaml

from fogml.errors import InputError
from fogml.export.losses import runs_of_each
from fogml.export.plan import Plan
from fogml.export.segments import segments
from fogml.export.static_curve import StaticCurve
from fogml.export.tables import TableSettings, export_tables
from fogml.models.names import make_model
from fogml.runs.facts import Facts
from fogml.runs.run import Run

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
DEG_H = np.pi / 180.0 / 3600.0


def curve(bias, temperature, scale=None):
    scale = np.ones(len(temperature)) if scale is None else scale
    return StaticCurve("T", temperature, bias, scale, "deg/h", ())


def test_no_choice_of_the_curves_own_temperatures_is_better():
    temperature = np.linspace(-20.0, 60.0, 15)
    bias = np.exp(temperature / 20.0) + np.sin(temperature / 15.0)
    found = segments(curve(bias, temperature), breakpoints=4, tolerance=1.0)
    off = np.interp(temperature, found.temperature, found.bias) - bias
    best = np.inf
    for inner in itertools.combinations(range(1, 14), 2):
        knots = temperature[[0, *inner, 14]]
        hats = np.column_stack([np.interp(temperature, knots, row) for row in np.eye(4)])
        values = np.linalg.lstsq(hats, bias, rcond=None)[0]
        best = min(best, float(np.sum((hats @ values - bias) ** 2)))
    assert float(off @ off) <= best * (1.0 + 1e-9)
    assert found.rms == pytest.approx(np.sqrt(np.mean(off**2)))
    assert found.largest == pytest.approx(np.abs(off).max())


def test_a_parabola_is_cut_into_equal_parts():
    temperature = np.linspace(-40.0, 60.0, 401)
    found = segments(curve(1e-3 * temperature**2, temperature), breakpoints=6, tolerance=1.0)
    assert np.diff(found.temperature) == pytest.approx(20.0, abs=0.8)
    # Chords of width h of a x^2 have a root mean square of a h^2/sqrt(120); the best lines have less.
    assert 0.5 < found.rms / (1e-3 * 20.0**2 / np.sqrt(120.0)) < 1.0


def test_as_few_as_the_tolerance_allows():
    temperature = np.linspace(0.0, 50.0, 101)
    whole = curve(np.sin(temperature / 8.0), temperature)
    found = segments(whole, tolerance=0.01)
    assert found.largest <= 0.01
    assert segments(whole, breakpoints=len(found.temperature) - 1, tolerance=1.0).largest > 0.01
    with pytest.raises(InputError, match="64 breakpoints are still off"):
        segments(whole, tolerance=1e-9)


def test_scale_factor_counts_at_the_stated_rate():
    temperature = np.linspace(0.0, 50.0, 201)
    bent = np.where(temperature < 25.0, 0.0, temperature - 25.0)
    whole = curve(np.zeros(201), temperature, 1.0 + 1e-6 * bent)
    found = segments(whole, breakpoints=3, tolerance=1.0)
    assert found.temperature[1] == pytest.approx(25.0, abs=0.3)
    flat = segments(whole, breakpoints=2, tolerance=1.0, rate_deg_s=10.0)
    assert segments(whole, breakpoints=2, tolerance=1.0, rate_deg_s=20.0).rms == pytest.approx(2.0 * flat.rms)


@pytest.mark.parametrize("name", ["polynomial", "M2", "memory", "rbf"])
def test_at_rest_is_what_the_model_says_of_constant_temperatures(model_of, name):
    model = model_of(name)
    found = StaticCurve.of(Plan.of(model), 9)
    plan = Plan.of(model)
    for i in (1, 4, 7):
        level = found.temperature[i]
        time = 10.0 * np.arange(2000)
        temperatures = {"T_in": np.full(2000, level)}
        box = dict(zip([atom.text for atom in plan.atoms], plan.limits.box_low + plan.limits.box_high))
        if "T_out" in plan.sensors:
            apart = 0.5 * (box["T_out"] - box["T_in"]) if "T_out" in box else None
            if apart is None:
                apart = 0.5 * (box[next(text for text in box if text == "lag(T_out, 900 s)")] - box["T_in"])
            temperatures["T_out"] = temperatures["T_in"] + apart
        run = Run.from_columns("rest", Facts(), time=time, gyro=np.zeros(2000), **temperatures)
        if not any(atom.operator == "play" for atom in plan.atoms):
            assert found.bias[i] == pytest.approx(float(model.predict(run)[-1]), abs=1e-6)
    moving = {"dT", "T*dT"} & set(model.features_.names())
    assert moving <= set(found.leaves_out)


def test_three_axes_and_a_matrix(axes, tmp_path):
    matrix = [[1.0, 1e-3, 0.0], [0.0, 1.0, -2e-3], [5e-4, 0.0, 0.999]]
    (tmp_path / "m.yaml").write_text(yaml.safe_dump({"matrix": matrix}))
    (tmp_path / "out").mkdir()
    models, runs = zip(*axes.values(), strict=True)
    settings = TableSettings("segments", "float64", tolerance=0.02, matrix=tmp_path / "m.yaml")
    report = export_tables(models, tmp_path / "out", settings, runs)
    assert [*report["axes"]] == ["x", "y", "z"]
    document = json.loads((tmp_path / "out" / "fogml_segments.json").read_text())
    assert document["matrix"] == matrix
    for axis, told in report["axes"].items():
        assert told["c_largest_difference"] < 1e-9
        assert told["largest_difference_at_rest"] <= 0.02
        assert told["leaves_out"] == ["dT"]
        loss = told["accuracy"]
        assert loss["rms_model"] <= loss["rms_exported"] < loss["rms_model"] + 0.02
        with (tmp_path / "out" / f"fogml_segments_{axis}.csv").open() as file:
            header, *rows = csv.reader(file)
        assert header == ["T [degC]", "bias [deg/h]"]
        assert [float(row[0]) for row in rows] == document["axes"][axis]["temperature_degc"]


@pytest.mark.parametrize("to", ["px4", "ardupilot"])
def test_parameters_subtract_the_drift(axes, tmp_path, to):
    report = export_tables([model for model, _ in axes.values()], tmp_path, TableSettings(to))
    (name,) = report["files"]
    lines = [line for line in (tmp_path / name).read_text().splitlines() if not line.startswith("#")]
    if to == "px4":
        held = {fields[2]: float(fields[3]) for fields in (line.split("\t") for line in lines)}
        # PX4 takes off both offsets (Gyroscope.hpp, Correct); the model's is the whole one.
        assert "set CAL_GYRO0_XOFF, CAL_GYRO0_YOFF, CAL_GYRO0_ZOFF to 0" in (tmp_path / name).read_text()
    else:
        held = {key: float(value) for key, value in (line.split(",") for line in lines)}
    for number, (axis, (model, _)) in enumerate(axes.items()):
        low, high = report["axes"][axis]["range_degc"]
        temperature = np.linspace(low, high, 7)
        if to == "px4":
            d = temperature - held["TC_G0_TREF"]
            offset = sum(held[f"TC_G0_X{power}_{number}"] * d**power for power in range(4))
        else:
            d, letter = temperature - 35.0, "XYZ"[number]
            c = [held[f"INS_TCAL1_GYR{power}_{letter}"] for power in (1, 2, 3)]
            offset = (c[0] + (c[1] + c[2] * d) * d) * d * 1e-6 + held[f"INS_GYROFFS_{letter}"]
            assert held["INS_GYR1_CALTEMP"] == 35.0
        run = Run.from_columns("rest", Facts(), time=np.arange(200.0), gyro=np.zeros(200), T=np.zeros(200))
        wanted = [model.predict(run.with_columns(T=np.full(200, t)))[-1] for t in temperature]
        assert offset / DEG_H == pytest.approx(wanted, abs=1e-4)


@pytest.mark.parametrize("middle", [-5.0, 60.0])
def test_ardupilot_holds_the_temperature_of_its_offset_within_the_range_too(tmp_path, middle):
    time = np.arange(0.0, 3600.0, 4.0)
    T = middle + 15.0 * np.sin(time / 500.0)
    columns = {"time": time, "gyro": 2.0 + 0.1 * T + 0.003 * T**2, "T": T}
    model = make_model("polynomial", features="T, T^2").fit(Run.from_columns("a", Facts(axis="x"), **columns))
    export_tables([model], tmp_path, TableSettings("ardupilot"))
    lines = (tmp_path / "fogml_ardupilot.param").read_text().splitlines()[1:]
    held = {key: float(value) for key, value in (line.split(",") for line in lines)}

    def polynomial(degc):  # polynomial_eval of AP_InertialSensor_tempcal.cpp
        d = np.clip(degc, held["INS_TCAL1_TMIN"], held["INS_TCAL1_TMAX"]) - 35.0
        return 1e-6 * sum(held[f"INS_TCAL1_GYR{power}_X"] * d**power for power in (1, 2, 3))

    at = middle + np.linspace(-14.0, 14.0, 9)
    subtracted = held["INS_GYROFFS_X"] + polynomial(at) - polynomial(held["INS_GYR1_CALTEMP"])
    assert subtracted / DEG_H == pytest.approx(2.0 + 0.1 * at + 0.003 * at**2, abs=1e-3)


@pytest.mark.parametrize("to", ["px4", "ardupilot"])
def test_a_drift_that_is_constant_has_parameters(tmp_path, to):
    time = np.arange(0.0, 3600.0, 4.0)
    columns = {"time": time, "gyro": np.zeros(len(time)), "T": 20.0 + 10.0 * np.sin(time / 500.0)}
    model = make_model("polynomial", features="T").fit(Run.from_columns("a", Facts(axis="z"), **columns))
    told = export_tables([model], tmp_path, TableSettings(to))["axes"]["z"]
    assert told["coefficients"] == pytest.approx([0.0] * 4, abs=1e-12)


@pytest.mark.parametrize("to", ["px4", "ardupilot", "segments"])
def test_the_loss_holds_what_the_form_leaves_out(axes, tmp_path, to):
    """Of 5 deg/h per degC/min on ramps of 2 degC/min a form without rates leaves 10 deg/h."""
    time = np.arange(0.0, 7200.0, 2.0)
    T = 80.0 - np.abs(2.0 * time / 60.0 - 120.0)
    noise = 0.1 * np.random.default_rng(0).standard_normal(len(time))
    gyro = 2.0 + 0.1 * T + 10.0 * np.sign(3600.0 - time) + noise
    run = Run.from_columns("ramps", Facts(), time=time, gyro=gyro, T=T)
    model = make_model("polynomial", features="T, dT[block, 16 s]").fit(run)
    told = export_tables([model], tmp_path, TableSettings(to), [run])["axes"]["x"]
    assert told["largest_difference_at_rest"] < 0.01
    assert told["accuracy"]["rms_model"] < 1.0
    assert told["accuracy"]["rms_exported"] == pytest.approx(10.0, rel=0.02)
    with pytest.raises(InputError, match="not one of the runs that the model was trained on"):
        export_tables([model], tmp_path, TableSettings(to), [axes["x"][1]])


def test_the_loss_is_of_the_sensors_that_stand_for_the_coils_temperature(axes, tmp_path):
    """A run with two coil sensors has no column T: its table leaves what a run of their mean does."""
    _, run = axes["x"]
    mean = run.columns["T"]
    apart = run.with_columns(T1=mean + 0.5, T3=mean - 0.5)
    pair = Run("pair", {k: v for k, v in apart.columns.items() if k != "T"}, apart.facts)
    left = []
    for name, held in (("one", run), ("two", pair)):
        model = make_model("polynomial", features="T^1..3, dT").fit(held)
        (tmp_path / name).mkdir()
        exported = export_tables([model], tmp_path / name, TableSettings(to="segments"), [held])
        left.append(exported["axes"]["x"]["accuracy"]["rms_exported"])
    assert left[1] == pytest.approx(left[0], rel=1e-6)


def test_what_does_not_go_together_is_told(axes, tmp_path, model_of):
    x = axes["x"][0]
    rest = Run("rest", {"time": np.arange(200.0), "gyro": np.zeros(200), "T": np.full(200, 20.0)})
    anonymous = make_model("mean").fit(rest)
    for models, settings, told in [
        ([x, x], TableSettings("segments"), "axis, x, y or z; one states 'x' again"),
        ([x, anonymous], TableSettings("segments"), "one states none; the side files of its runs state it"),
        ([x], TableSettings("segments", breakpoints=1), "from 2 to 64"),
        ([x], TableSettings("segments", "q15"), "takes float32 and float64"),
        ([model_of("none")], TableSettings("px4"), "of no temperature"),
        ([model_of("joint")], TableSettings("px4"), "no scale factor over temperature"),
        ([x], TableSettings("px4", tolerance=1e-12), "Nothing was written"),
    ]:
        with pytest.raises(InputError, match=told):
            export_tables(models, tmp_path, settings)
    (tmp_path / "m.yaml").write_text("[[1, 0], [0, 1]]")
    with pytest.raises(InputError, match="three rows of three numbers"):
        export_tables([x], tmp_path, TableSettings("segments", matrix=tmp_path / "m.yaml"))
    outer = axes["y"][1]
    outer = Run("y", {"time": outer.time, "gyro": outer.gyro, "T_out": outer.columns["T"]}, outer.facts)
    other = make_model("polynomial", features="T_out").fit(outer)
    with pytest.raises(InputError, match="for all axes; these models are over T_in and T_out"):
        export_tables([x, other], tmp_path, TableSettings("ardupilot"))


@pytest.mark.parametrize("axis", ["roll-1", "*/ int evil;"])
def test_an_axis_of_any_name_has_a_table_in_c(tmp_path, axis):
    time = np.arange(0.0, 4000.0, 4.0)
    T = 20.0 + 15.0 * np.sin(time / 600.0)
    run = Run.from_columns("a", Facts(axis=axis), time=time, gyro=0.1 * T, T=T)
    model = make_model("polynomial", features="T").fit(run)
    assert (
        export_tables([model], tmp_path, TableSettings("segments"))["axes"][axis]["c_largest_difference"]
        < 0.01
    )


def test_the_bytes_stated_of_tables_are_those_of_the_numbers_in_c(axes, model_of, tmp_path):
    joint = model_of("joint")
    for place, models in enumerate(([model for model, _ in axes.values()], [joint])):
        (folder := tmp_path / str(place)).mkdir()
        report = export_tables(models, folder, TableSettings("segments", "float32"))
        source = (folder / "fogml_segments.c").read_text()
        arrays = re.findall(r"static const fogml_segments_real \w+\[(\d+)\]", source)
        assert sum(told["bytes"] for told in report["axes"].values()) == 4 * sum(map(int, arrays))


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_c_of_a_table_tells_what_is_no_number_with_fast_math_too(axes, tmp_path, dtype):
    export_tables([axes["x"][0]], tmp_path, TableSettings("segments", dtype))
    calls = "    failed += fogml_segments(&at, &output, &out) != expected;\n"
    lines = "".join(
        f"    at = {at}; output = {output}; expected = {flag};\n{calls}"
        for at, output, flag in [("20", "1", 0), ("NAN", "1", 2), ("20", "NAN", 2), ("INFINITY", "1", 2)]
    )
    (tmp_path / "main.c").write_text(
        '#include <math.h>\n#include "fogml_segments.h"\nint main(void)\n{\n'
        "    volatile fogml_segments_real in = 0;\n    fogml_segments_real at = in, output = in, out = in;\n"
        f"    int expected, failed = 0;\n{lines}    return failed;\n}}\n"
    )
    words = ["gcc", "-std=c99", "-O2", "-ffast-math", "main.c", "fogml_segments.c", "-o", "main"]
    subprocess.run(words, cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "main"]).returncode == 0


def test_a_run_that_none_was_trained_on_is_refused(axes, tmp_path):
    models, (_, run) = [model for model, _ in axes.values()], axes["x"]
    other = run.with_columns(gyro=run.gyro + 1.0)
    with pytest.raises(InputError, match="is not one of the runs that the model was trained on"):
        export_tables(models, tmp_path, TableSettings("segments"), [other])


def test_each_model_gets_the_runs_that_it_was_trained_on(axes):
    models, runs = [model for model, _ in axes.values()], [run for _, run in axes.values()]
    assert runs_of_each(models, runs[::-1]) == [[run] for run in runs]
    assert runs_of_each(models[:2], runs[1:2]) == [[], runs[1:2]]


def test_a_joint_models_scale_factor(model_of, tmp_path):
    report = export_tables([model_of("joint")], tmp_path, TableSettings("segments", "float64"))
    (told,) = report["axes"].values()
    held = json.loads((tmp_path / "fogml_segments.json").read_text())["axes"]["x"]
    temperature = np.array(held["temperature_degc"])
    # The scale of the run's truth: 1 + 1e-4 - 2e-6 (T - 25) + 1e-8 T^2, which the model undoes.
    truth = 1.0 / (1.0 + 1e-4 - 2e-6 * (temperature - 25.0) + 1e-8 * temperature**2)
    assert np.array(held["scale"]) == pytest.approx(truth, abs=5e-6)
    assert told["bytes"] == 3 * 8 * told["breakpoints"]
