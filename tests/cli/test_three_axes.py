"""Commands on a file of three gyros: a folder an axis, as a file of that axis gives, an index, one C file."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from fogml.cli.fleet_unit import UnitWork
from fogml.cli.main import app
from fogml.fleet.constants import FORM
from fogml.fleet.manifest import Unit
from fogml.runs.reading import read_run
from tests.cli.conftest import csv_text

AXES = ("x", "y", "z")
GAINS = {"x": 1.0, "y": 2.0, "z": -1.5}


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Two files of three gyros, and beside them the same as a file an axis."""
    folder = tmp_path_factory.mktemp("three")
    for seed, name in enumerate(("a", "b")):
        rows = [line.split(",") for line in csv_text(seed, rows=400).splitlines()]
        time, gyro, temperature = zip(*rows[1:], strict=True)
        of = {axis: [f"{gain * float(g):.6f}" for g in gyro] for axis, gain in GAINS.items()}
        lines = [",".join(row) for row in zip(time, *of.values(), temperature, strict=True)]
        head = "time [s],gyro_x [deg/h],gyro_y [deg/h],gyro_z [deg/h],T [degC]"
        (folder / f"{name}.csv").write_text("\n".join([head, *lines]) + "\n")
        (folder / f"{name}.yaml").write_text("unit: FOG-3\n")
        for axis, values in of.items():
            alone = folder / axis
            alone.mkdir(exist_ok=True)
            text = "\n".join(",".join(row) for row in zip(time, values, temperature, strict=True))
            (alone / f"{name}.csv").write_text(f"time [s],gyro [deg/h],T [degC]\n{text}\n")
            (alone / f"{name}.yaml").write_text(f"unit: FOG-3\naxis: {axis}\n")
    return folder


@pytest.fixture(scope="module")
def trained(home, tmp_path_factory):
    """Folder and printed result of a training on the file of three gyros."""
    out = tmp_path_factory.mktemp("trained") / "results"
    words = ["train", home / "a.csv", "--test", home / "b.csv", "--model", "M2", "--json", "-o", out]
    result = CliRunner().invoke(app, list(map(str, words)))
    assert result.exit_code == 0, result.stderr
    return out, json.loads(result.stdout)


def test_train_gives_an_axis_what_its_own_file_gives(home, trained, invoke_json, tmp_path):
    out, values = trained
    assert (values["schema"], values["command"], list(values["axes"])) == (
        "fogml.axes/1",
        "train",
        list(AXES),
    )
    runs = (home / "y" / "a.csv", "--test", home / "y" / "b.csv")
    alone = invoke_json("train", *runs, "--model", "M2", "-o", tmp_path / "y")
    assert values["axes"]["y"] == alone
    assert json.loads((out / "y" / "report.json").read_text()) == alone
    page = (out / "index.html").read_text()
    assert all(f'href="{axis}/report.html"' in page for axis in AXES) and "Use it" in page
    again = yaml.safe_load((out / "y" / "train.config.yaml").read_text())
    assert (again["axis"], again["out"]) == ("y", str(out / "y"))
    assert yaml.safe_load((out / "train.config.yaml").read_text())["axis"] is None


@pytest.mark.parametrize(
    ("words", "page"),
    [
        (("inspect", "a.csv"), "inspect"),
        (("noise", "a.csv"), "noise"),
        (("compare", "a.csv", "--test", "b.csv", "--models", "none,mean"), "compare"),
        (("lab", "acceptance", "a.csv", "--model", "MODELS"), "acceptance"),
    ],
)
def test_other_commands_write_a_folder_an_axis(home, trained, invoke, tmp_path, monkeypatch, words, page):
    monkeypatch.chdir(home)
    words = [trained[0] if word == "MODELS" else word for word in words]
    out = tmp_path / "results"
    printed = invoke(*words, "-o", out).stdout
    assert [f"Axis {axis}" in printed for axis in AXES] == [True] * 3
    assert "partial" not in printed  # no passing name of a folder
    for axis in AXES:
        assert (out / axis / f"{page}.json").is_file()
    assert all(f'href="{axis}/{page}.html"' in (out / "index.html").read_text() for axis in AXES)


def test_without_a_folder_the_axes_are_told(home, invoke_json):
    values = invoke_json("inspect", home / "a.csv")
    assert [values["axes"][axis]["runs"][0]["axis"] for axis in AXES] == list(AXES)


def test_nothing_is_left_where_one_axis_fails(home, invoke, tmp_path):
    text = (home / "a.csv").read_text().replace("gyro_y [deg/h]", "gyro_y [count]")
    (tmp_path / "c.csv").write_text(text)
    out = tmp_path / "results"
    assert "no scale factor" in invoke("noise", tmp_path / "c.csv", "-o", out, status=2).stderr
    assert not out.exists()


def test_compensate_takes_the_model_of_each_axis(home, trained, invoke, tmp_path):
    models, out = trained[0], tmp_path / "comp.csv"
    invoke("compensate", home / "b.csv", "--model", models, "-o", out)
    for axis in AXES:
        alone = tmp_path / f"alone-{axis}.csv"
        invoke("compensate", home / axis / "b.csv", "--model", models / axis, "-o", alone)
        assert (tmp_path / f"comp-{axis}.csv").read_text() == alone.read_text()
    told = invoke("compensate", home / "b.csv", "--model", models / "x", "-o", out, status=2).stderr
    assert "holds no folder 'x'" in told and "--axis" in told


@pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
def test_one_c_file_gives_what_compensate_gives(home, trained, invoke_json, invoke, tmp_path, monkeypatch):
    # Sizes and cycles on another machine are told of each axis alone elsewhere.
    monkeypatch.setattr("fogml.export.export.cortex_m4_size", lambda *_: None)
    out, matrix = tmp_path / "c", np.array([[1.0, 1e-3, 0.0], [0.0, 1.0, -2e-3], [5e-4, 0.0, 0.999]])
    (tmp_path / "matrix.yaml").write_text(json.dumps({"matrix": matrix.tolist()}))
    by = ("--matrix", tmp_path / "matrix.yaml")
    told = invoke("export", trained[0], "--dtype", "q31", *by, "-o", out, status=2).stderr
    assert "each axis is a call of its own" in told
    values = invoke_json("export", trained[0], "--dtype", "float64", *by, "-o", out)
    assert values["matrix"] == matrix.tolist()
    assert list(values["axes"]) == list(AXES) and "fogml_axes.c" in values["files"]
    assert "<U+" not in (out / "fogml_axes.h").read_text()
    library = tmp_path / "axes.so"
    words = ["-std=c99", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    subprocess.run(["gcc", *words, out / "fogml_axes.c", "-o", library], check=True)
    code = ctypes.CDLL(str(library))
    assert code.fogml_axes_self_test() == 0
    text = (out / "fogml_axes.c").read_text()
    (tmp_path / "changed.c").write_text(text.replace("{ 0.0, 1.0, -0.002 }", "{ 0.0, 1.0, -0.0021 }", 1))
    changed = tmp_path / "changed.so"
    subprocess.run(["gcc", *words, "-I", out, tmp_path / "changed.c", "-o", changed], check=True)
    assert ctypes.CDLL(str(changed)).fogml_axes_self_test() != 0
    state = ctypes.create_string_buffer(3 * max(code[f"fogml_{axis}_state_bytes"]() for axis in AXES) + 64)
    code.fogml_axes_init(state)
    runs = [read_run(home / "b.csv", axis=axis) for axis in AXES]
    left, flags = [], []
    three = ctypes.c_double * 3
    for row in range(len(runs[0])):
        temperature = (ctypes.c_double * 1)(runs[0].columns["T"][row])
        gyro, got, flag = three(*(run.gyro[row] for run in runs)), three(), (ctypes.c_int * 3)()
        worst = code.fogml_axes_step(
            state, ctypes.c_uint64(round(1e6 * runs[0].time[row])), temperature, gyro, got, flag
        )
        assert worst == max(flag)
        left.append(list(got))
        flags.append(list(flag))
    invoke("compensate", home / "b.csv", "--model", trained[0], "-o", tmp_path / "comp.csv")
    tables = [np.genfromtxt(tmp_path / f"comp-{axis}.csv", delimiter=",", names=True) for axis in AXES]
    np.testing.assert_array_equal(flags, np.column_stack([table["flag"] for table in tables]))
    alone = np.column_stack([table["gyro_compensated_degh"] for table in tables])
    np.testing.assert_allclose(left, alone @ matrix.T, atol=1e-5)


def test_a_fleet_takes_the_axis_that_its_manifest_names(home, tmp_path):
    unit = Unit("FOG-3", "train", (str(home / "a.csv"),), (str(home / "b.csv"),), "z", "z")
    UnitWork({"model": "mean", "averaging": 100.0}, FORM)(unit, tmp_path / "z")
    report = json.loads((tmp_path / "z" / "report.json").read_text())
    assert [run["axis"] for run in (*report["train"], *report["test"])] == ["z", "z"]


def test_an_axis_without_a_value_is_told_with_the_way_to_the_others(home, invoke, invoke_json, tmp_path):
    """A clock that counts from 1970, beside it: the table's ends are told apart."""
    rows = [line.split(",") for line in (home / "a.csv").read_text().splitlines()]
    for row in rows[1:]:
        row[0], row[2] = f"{1.79e9 + float(row[0]):.1f}", ""
    run = tmp_path / "epoch.csv"
    run.write_text("\n".join(map(",".join, rows)) + "\n")
    said = invoke("inspect", run, status=2).stderr
    assert "'gyro_y'" in said and "take another axis alone (--axis)" in said
    shown = next(line for line in invoke("inspect", run, "--axis", "z").stdout.splitlines() if "time" in line)
    assert shown.split()[2] != shown.split()[3]
    alone = invoke_json("noise", run, "--axis", "z")
    whole = invoke_json("noise", home / "a.csv", "--axis", "z")
    assert alone["adev"] == pytest.approx(whole["adev"], rel=1e-9)


def test_nothing_is_said_to_be_written_where_an_axis_fails(home, tmp_path):
    run = tmp_path / "c.csv"
    lines = (home / "a.csv").read_text().splitlines()
    cells = lines[10].split(",")
    run.write_text("\n".join([*lines[:10], ",".join([*cells[:2], "nan", *cells[3:]]), *lines[11:]]) + "\n")
    words = ["train", str(run), "--test", str(home / "b.csv"), "--model", "M2", "-o", str(tmp_path / "out")]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 2 and "column 'gyro_y', line 11" in result.stderr
    assert "Written" not in result.stdout and not (tmp_path / "out").exists()
