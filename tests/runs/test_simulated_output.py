"""What another simulator gives for a run: read from its files, and brought to the run's times."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from shutil import which

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.other_rate import at_times_of, is_simulator_output, read_gnss_ins_sim
from fogml.runs.reading import read_run
from fogml.runs.run import Run
from tests.cli.conftest import run_program


def write_gnss(folder, seeds=(0, 1), unit="deg/s", rows=401):
    """Results as gnss-ins-sim saves them: np.savetxt with one line of names."""
    time = 0.5 * np.arange(rows)
    np.savetxt(folder / "time.csv", time, header="time (sec)", delimiter=",", comments="")
    for seed in seeds:
        noise = 1e-6 * np.random.default_rng(seed).normal(size=(rows, 3))
        head = ",".join(f"gyro_{axis} ({unit})" for axis in "xyz")
        rates = noise + np.array([0.0, 0.001, 0.002]) * (1.0 + time[:, None])
        np.savetxt(folder / f"gyro-{seed}.csv", rates, header=head, delimiter=",", comments="")
    return time


@pytest.mark.parametrize(
    ("unit", "factor"), [("deg/s", 3600.0), ("rad/s", np.degrees(3600.0)), ("deg/hr", 1.0)]
)
def test_a_folder_of_gnss_ins_sim(tmp_path, unit, factor):
    time = write_gnss(tmp_path, unit=unit)
    found, rate = read_gnss_ins_sim(tmp_path, "z")
    np.testing.assert_array_equal(found, time)
    np.testing.assert_allclose(rate, factor * 0.002 * (1.0 + time), atol=5e-6 * factor)
    np.testing.assert_array_equal(read_gnss_ins_sim(tmp_path, "-z")[1], -rate)
    assert is_simulator_output(tmp_path) and not is_simulator_output("nominal")


def test_finer_steps_are_averaged_and_coarser_ones_joined_by_lines():
    run = Run("r", {"time": np.arange(0.0, 100.0, 10.0), "gyro": np.zeros(10)})
    fine = np.arange(-10.0, 110.0, 0.1)
    wave = at_times_of(run, fine, 5.0 + np.sin(2.0 * np.pi * fine), "fine")
    np.testing.assert_allclose(wave[1:-1], 5.0, atol=1e-3)
    coarse = np.arange(-20.0, 130.0, 20.0)
    np.testing.assert_allclose(at_times_of(run, coarse, 2.0 * coarse, "coarse"), 2.0 * run.time)


def test_what_is_wrong_is_named(tmp_path):
    run = Run("r", {"time": np.arange(0.0, 900.0, 10.0), "gyro": np.zeros(90)})
    with pytest.raises(InputError, match=r"no time.csv and gyro-0.csv"):
        read_gnss_ins_sim(tmp_path, "x")
    time = write_gnss(tmp_path, seeds=(0,))
    with pytest.raises(InputError, match="--axis, of x, y, z"):
        read_gnss_ins_sim(tmp_path, None)
    with pytest.raises(InputError, match="covers 0 to 200 s, the run 0 to 890 s"):
        at_times_of(run, *read_gnss_ins_sim(tmp_path, "x"), "there")
    with pytest.raises(InputError, match="increase"):
        at_times_of(run, time[::-1], time, "there")
    (tmp_path / "gyro-0.csv").write_text("gyro_x (deg/s),gyro_y (deg/s)\n1,2\n")
    with pytest.raises(InputError, match=r"2 columns.*3 were expected"):
        read_gnss_ins_sim(tmp_path, "x")
    (tmp_path / "gyro-0.csv").write_text("gyro_x,gyro_y,gyro_z\na,b,c\n")
    with pytest.raises(InputError, match="rows of 3 numbers"):
        read_gnss_ins_sim(tmp_path, "x")
    write_gnss(tmp_path, seeds=(0,), unit="mdps")
    with pytest.raises(InputError, match="unit 'mdps'"):
        read_gnss_ins_sim(tmp_path, "x")


@pytest.mark.skipif(which("octave") is None, reason="Octave is not installed")
def test_the_guide_s_example_for_matlab_runs_in_octave(tmp_path):
    guide = (Path(__file__).parents[2] / "docs" / "closing-the-loop.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```matlab\n(names = .*?)```", guide, flags=re.DOTALL)
    (tmp_path / "model.m").write_text(example)
    run_program("simulate", "--programme", "four-positions", "--sample", "10", "-o", tmp_path / "run-a.csv")
    command = ["octave", "--no-gui", "--quiet", "--norc", "model.m"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, timeout=60)
    own = tmp_path / "own-a.csv"
    run_program("replay", tmp_path / "matlab-a.csv", tmp_path / "run-a.csv", "-o", own)
    columns = read_run(own).columns
    np.testing.assert_allclose(columns["replayed"], 9.66 + 2e-3 * (columns["T_in"] - 25.0), rtol=1e-9)
