"""Units that the run format does not name: converted by what they are, refused where they are a slip."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.columns import KNOWN, canonical_unit, conversion, converted
from fogml.runs.header_spelling import canonical_cells
from fogml.runs.profiles import import_recording
from fogml.runs.reading import read_run


@pytest.mark.parametrize(
    ("unit", "internal", "factor"),
    [
        ("deg/day", "deg/h", 1.0 / 24.0),
        ("arcmin/h", "deg/h", 1.0 / 60.0),
        ("arcminute/min", "deg/h", 1.0),
        ("mdeg/h", "deg/h", 1e-3),
        ("arcsec/ms", "deg/h", 1e3),
        ("turn/min", "deg/s", 6.0),
        ("day", "s", 86400.0),
        ("ks", "s", 1000.0),
    ],
)
def test_units_by_what_they_are(unit: str, internal: str, factor: float) -> None:
    assert converted(unit, internal) == pytest.approx((factor, 0.0))


@pytest.mark.parametrize(
    ("unit", "internal"),
    [("deg/hh", "deg/h"), ("deg/mh", "deg/h"), ("deg/kmin", "deg/h"), ("mdeg/hh", "deg/h"), ("hh", "s")],
)
def test_multiples_of_hours_and_minutes_are_slips(unit: str, internal: str) -> None:
    assert converted(unit, internal) is None


@pytest.mark.parametrize("unit", ["Grad/h", "grad/s", "rps", "mrps"])
def test_units_of_two_meanings_are_refused(unit: str) -> None:
    """Grad is a degree in German and 0.9 of one elsewhere; rps is radians or revolutions a second."""
    told = f"write {unit.lower().replace('grad', 'deg')} where" if "rad" in unit else "not accepted here"
    with pytest.raises(InputError, match=told):
        conversion("gyro", canonical_unit(unit), "log.csv")


def test_units_in_chinese_are_those_of_their_signs(tmp_path) -> None:
    path = tmp_path / "log.csv"
    rows = "".join(f"{i},{7200.5 + i % 3},{25 + 0.1 * i}\n" for i in range(40))
    path.write_text(
        "采样时间（毫秒），陀螺（度/小时），温度（℃）\n".replace("，", ",") + rows, encoding="gbk"
    )
    run = read_run(path)
    np.testing.assert_allclose(run.time, 1e-3 * np.arange(40.0))
    np.testing.assert_allclose(run.gyro, 7200.5 + np.arange(40) % 3)
    assert [canonical_unit(u) for u in ("度/秒", "弧度/秒", "°/小时")] == ["deg/s", "rad/s", "deg/h"]


def test_a_gyro_whose_unit_is_none_is_told_by_its_unit(tmp_path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("Time [s],Gyro [Grad/h]\n" + "".join(f"{i},{7.5 + i % 3}\n" for i in range(40)))
    with pytest.raises(InputError, match="'Grad/h', degrees in German and gon elsewhere; write deg/h"):
        read_run(path)


def test_a_point_after_an_abbreviation_is_no_part_of_the_name() -> None:
    assert canonical_cells(["Time (s)", "Gyro (deg/h)", "Temp. (°C)"])[2] == "T [degC]"


@pytest.mark.parametrize("unit", ["arcsec", "deg", "urad"])
def test_angles_of_a_sample_are_refused_with_the_profile_that_makes_rates_of_them(tmp_path, unit):
    angles = np.arange(40.0)
    path, profile = tmp_path / "log.csv", tmp_path / "profile.yaml"
    path.write_text(f"time [s],gyro [{unit}]\n" + "".join(f"{0.5 * i},{a}\n" for i, a in enumerate(angles)))
    with pytest.raises(InputError, match="the angle turned in a sample") as refused:
        read_run(path)
    scale = float(re.search(r"scale (\S+) over the sample interval", str(refused.value))[1]) / 0.5
    gyro = f"{{source: 'gyro [{unit}]', unit: deg/s, scale: {scale}}}"
    columns = f"columns: {{time: {{source: 'time [s]', unit: s}}, gyro: {gyro}}}\n"
    profile.write_text("schema: fogml.import/1\ndescription: angles\nseparator: comma\n" + columns)
    (run,) = import_recording(path, profile)
    in_degrees = {"arcsec": 1.0 / 3600.0, "deg": 1.0, "urad": np.degrees(1e-6)}[unit]
    np.testing.assert_allclose(run.gyro, 3600.0 * angles * in_degrees / 0.5, rtol=1e-5)


@pytest.mark.parametrize(
    ("unit", "known"),
    [("Â°C", "degC"), ("øC", "degC"), ("¡/h", "deg/h"), ("oC", "degC"), ("o/s", "deg/s"), ("deg. C", "degC"),
     ("deg./h", "deg/h"), ("°С", "degC"), ("град/ч", "deg/h"), ("kat/h", "kat/h"), ("pro/s", "pro/s")],
)  # fmt: skip
def test_signs_of_degrees_that_were_read_as_others(unit, known):
    """As files in code page 437, MacRoman or UTF-8 show them where they are read as Latin-1."""
    assert canonical_unit(unit) == known


def test_a_column_in_its_internal_unit_is_left_as_it_is():
    for name, spec in KNOWN.items():
        assert spec.units[spec.internal] == (1.0, 0.0), name
