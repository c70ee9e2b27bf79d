"""A file of three gyros: one run an axis, with what the file and its side file say of that axis."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.reading import read_blocks, read_run
from fogml.runs.run import Run
from fogml.runs.three_axes import SeveralAxes
from fogml.runs.writing import write_run
from tests.runs.files import write_table

ROWS = 40


@pytest.fixture
def file(tmp_path):
    """A file of three gyros in units of their own, with a table rate of z."""

    def write(side: str = "", rate: str = "", suffix: str = ".csv"):
        time = np.arange(ROWS, dtype=float)
        heads = ["time [s]", "gyro_x [deg/h]", "gyro_y [deg/s]", "gyro_z [deg/h]", "T [degC]"]
        columns = [time, 1.0 + time, (2.0 + time) / 3600.0, 3.0 + time, 20.0 + time]
        if rate:
            heads.append(f"{rate} [deg/s]")
            columns.append(np.where(time < 20, 0.0, 5.0))
        path = tmp_path / f"three{suffix}"
        rows = "\n".join(",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True))
        path.write_text(",".join(heads) + "\n" + rows + "\n")
        path.with_suffix(".yaml").write_text(side or "unit: FOG-3\n")
        return path

    return write


@pytest.mark.parametrize(("axis", "first"), [("x", 1.0), ("y", 2.0), ("z", 3.0)])
def test_each_axis_is_a_run_with_the_shared_temperature(file, axis, first):
    run = read_run(file(), axis=axis)
    assert set(run.columns) == {"time", "gyro", "T"}
    np.testing.assert_allclose(run.gyro, first + np.arange(ROWS), rtol=1e-12)
    assert (run.facts.axis, run.facts.unit) == (axis, "FOG-3")


def test_blocks_join_to_the_run(file):
    blocks = list(read_blocks(file(), axis="y", block_rows=7, columns=["T"]))
    whole = read_run(file(), axis="y")
    for name in ("time", "gyro", "T"):
        joined = np.concatenate([block.columns[name] for block in blocks])
        np.testing.assert_array_equal(joined, whole.columns[name])
    assert {block.facts.axis for block in blocks} == {"y"}


def test_without_an_axis_the_file_says_what_it_holds(file):
    with pytest.raises(SeveralAxes, match=r"gyro_x, gyro_y, gyro_z.*--axis x") as caught:
        read_run(file())
    assert caught.value.axes == ("x", "y", "z")
    with pytest.raises(InputError, match="'w': one of x, y, z"):
        read_run(file(), axis="w")


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_so_it_does_where_a_few_columns_are_asked_for(tmp_path, suffix):
    columns = {"time [s]": np.arange(20.0), "gyro_y [deg/h]": np.arange(20.0), "T [degC]": np.arange(20.0)}
    path = write_table(tmp_path / f"run{suffix}", columns)
    with pytest.raises(SeveralAxes):
        next(read_blocks(path, columns=["T"]))
    with pytest.raises(InputError, match="no column 'gyro_x'; it holds y"):
        next(read_blocks(path, columns=["T"], axis="x"))


def test_facts_of_each_axis(file):
    side = "unit: FOG-3\nlatitude: 40.0\naxes: {x: {input_axis: north}, z: {input_axis: up}}\n"
    path = file(side)
    rates = {axis: read_run(path, axis=axis).facts.earth_rate_deg_h for axis in "xyz"}
    assert rates["x"] == pytest.approx(15.041067 * np.cos(np.radians(40.0)))
    assert rates["z"] == pytest.approx(15.041067 * np.sin(np.radians(40.0)))
    assert rates["y"] is None


def test_an_attitude_of_one_axis_is_not_taken_for_another(file):
    path = file("axis: z\nlatitude: 40.0\ninput_axis: up\n")
    assert read_run(path, axis="z").earth_known
    other = read_run(path, axis="x")
    assert not other.earth_known
    assert "input_axis_of_another" in {finding.code for finding in other.findings}


def test_a_table_turns_about_the_axis_that_is_named(file):
    path = file("axis: z\n", rate="rate")
    assert read_run(path, axis="z").rate.max() == 5.0
    other = read_run(path, axis="x")
    assert other.rate.max() == 0.0 and "rate_of_another_axis" in {f.code for f in other.findings}
    with pytest.raises(InputError, match="nothing tells about which axis"):
        read_run(file("unit: FOG-3\n", rate="rate"), axis="z")
    assert read_run(file(rate="rate_y"), axis="y").rate.max() == 5.0
    assert read_run(file(rate="rate_y"), axis="x").rate.max() == 0.0


def test_a_run_of_one_gyro_has_to_be_of_the_axis(tmp_path):
    time = np.arange(10.0)
    path = tmp_path / "one.csv"
    write_run(Run.from_columns("one", time=time, gyro=time, T=time), path)
    with pytest.raises(InputError, match="does not state its axis; write 'axis: y'"):
        read_run(path, axis="y")
    path.with_suffix(".yaml").write_text("axis: x\n")
    with pytest.raises(InputError, match="is of axis 'x'"):
        read_run(path, axis="y")
    assert read_run(path, axis="x").facts.axis == "x"


def test_a_fault_is_in_the_column_as_the_file_calls_it(file):
    path = file()
    path.write_text(path.read_text().replace("4.0,5.0,", "4.0,nan,", 1))
    with pytest.raises(InputError, match="column 'gyro_x', line 6"):
        read_run(path, axis="x")
    with pytest.raises(InputError, match="column 'gyro_x', line 6"):
        list(read_blocks(path, axis="x"))
    assert len(read_run(path, axis="y")) == ROWS
