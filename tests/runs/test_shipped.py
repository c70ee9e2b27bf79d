"""The shipped recordings against figures printed in the originals or known of them."""

from __future__ import annotations

import numpy as np
import pyarrow.parquet as parquet
import pytest

from fogml.errors import InputError
from fogml.runs.shipped import PROFILES, RECORDING_FOLDER, shipped_names, shipped_run

allantools = pytest.importorskip("allantools")


def rejected_rows(run) -> int:
    return sum(finding.count for finding in run.findings if finding.code == "rejected_rows")


def test_names():
    names = shipped_names()
    assert len(names) == len(set(names)) == 21
    assert {"thermal-cycle-1-x", "cold-start-z", "two-temperatures-hot-y", "ring-laser-z"} <= set(names)


def test_an_unknown_name_lists_the_known():
    with pytest.raises(InputError, match="ring-laser-z"):
        shipped_run("ring-laser-w")


@pytest.mark.parametrize("name", shipped_names())
def test_every_run_is_sound_and_says_that_it_is_no_fog(name):
    run = shipped_run(name)
    assert run.name == name
    assert run.facts.axis == name[-1]
    assert "not a fibre-optic gyro" in run.facts.notes
    assert ("ring-laser" if name.startswith("ring") else "MEMS") in run.facts.notes
    assert "licence" in run.facts.notes
    assert run.time[0] == 0.0
    assert (np.diff(run.time) > 0).all()
    for values in run.columns.values():
        assert np.isfinite(values).all()


def test_small_and_licensed():
    files = list(RECORDING_FOLDER.iterdir())
    assert sum(file.stat().st_size for file in files) < 2_000_000
    for profile in set(PROFILES.values()):
        text = (RECORDING_FOLDER / f"LICENSE.{profile}.txt").read_text()
        assert "copyright" in text.lower()


def test_stored_digits_are_those_printed():
    table = parquet.read_table(RECORDING_FOLDER / "thermal-cycle.parquet")
    for name in ("imu.gyro.x", "imu.gyro.y", "imu.gyro.z", "imu.temperature"):
        values = table[name].to_pylist()
        assert values == [float(f"{value:.10g}") for value in values]


def test_thermal_cycle():
    down, up, again = (shipped_run(f"thermal-cycle-{leg}-x") for leg in (1, 2, 3))
    assert [len(run) for run in (down, up, again)] == [2687, 3502, 2206]
    # Rows 5 and 8399 of the original.
    assert down.gyro[0] == pytest.approx(-0.07072292268 * 3600, rel=1e-12)
    assert down.temperature()[0] == 51.96499634
    assert again.gyro[-1] == pytest.approx(-0.06131127849 * 3600, rel=1e-12)
    assert again.temperature()[-1] == 36.27553558
    assert up.temperature()[0] == pytest.approx(-17.6, abs=0.05)
    assert again.temperature()[0] == pytest.approx(74.0, abs=0.05)
    assert up.span_s == pytest.approx(0.5057 * 3501)
    assert rejected_rows(down) == 5
    # The first row, then those of no leg, counted from 1.
    assert [f.row for f in down.findings if f.code == "rejected_rows"] == [1, 2]


def test_cold_start_has_378_gaps():
    run = shipped_run("cold-start-y")
    assert len(run) == 63_792
    assert len(run.stretches) == 379
    assert run.temperature("T")[0] == pytest.approx(10.4, abs=0.01)
    assert run.temperature("T").max() == pytest.approx(28.9, abs=0.05)
    assert run.columns["T_case"].min() == pytest.approx(8.58)
    assert run.columns["T_case"].max() == pytest.approx(28.0, abs=0.05)
    assert run.span_s == pytest.approx(2157.971)


def test_two_temperatures():
    cold, hot = (shipped_run(f"two-temperatures-{name}-x") for name in ("cold", "hot"))
    assert cold.temperature().mean() == pytest.approx(13.06, abs=0.02)
    assert hot.temperature().mean() == pytest.approx(47.6, abs=0.05)
    assert hot.temperature().max() < 48.0  # what was left in the buffer at 49.36 degC is gone
    assert rejected_rows(hot) == 13


def test_the_ring_laser_sees_the_earth_turn():
    rates = [shipped_run(f"ring-laser-{axis}").gyro.mean() for axis in "xyz"]
    assert rates == pytest.approx([-12.27, 0.44, 8.36], abs=0.005)
    assert np.linalg.norm(rates) == pytest.approx(14.85, abs=0.005)


def test_the_ring_laser_has_the_known_allan_deviation():
    run = shipped_run("ring-laser-z")
    assert len(run) == 184_718
    taus = [1.0, 10.0, 60.0]
    _, overlapping, _, _ = allantools.oadev(run.gyro, rate=100.0, data_type="freq", taus=taus)
    _, plain, _, _ = allantools.adev(run.gyro, rate=100.0, data_type="freq", taus=taus)
    assert overlapping == pytest.approx([8.71, 1.49, 0.40], abs=0.005)
    assert plain == pytest.approx([7.25, 1.53, 0.28], abs=0.006)
