"""Frames with sums as NMEA 0183 has them, and numbers in hexadecimal, by a profile."""

from __future__ import annotations

from functools import reduce

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.profile_draft import draft_profile
from fogml.runs.profiles import import_recording, load_profile

COUNT = 80
GYRO = np.round(9.6 + 0.001 * (np.arange(COUNT) ** 2 % 997), 3)
WARM = 25.0 + np.arange(COUNT) / 8
PROFILE = """schema: fogml.import/1
description: d
separator: {separator}
{more}
columns:
  time: {{source: {time}, unit: s}}
  gyro: {{source: {gyro}, unit: {unit}}}
"""


def frame(text):
    return f"${text}*{reduce(lambda a, b: a ^ ord(b), text, 0):02X}"


def frames():
    return [frame(f"PGYRO,{i},{g},{w}") for i, (g, w) in enumerate(zip(GYRO, WARM, strict=True))]


def imported(tmp_path, lines, profile=None, ending="\r\n"):
    path = tmp_path / "a.txt"
    path.write_bytes(ending.join([*lines, ""]).encode())
    (tmp_path / "p.yaml").write_text(profile or draft_profile(path))
    return import_recording(path, load_profile(tmp_path / "p.yaml"))


def test_a_known_frame_has_the_sum_that_its_maker_states():
    assert frame("GPGLL,5300.97914,N,00259.98174,E,125926,A").endswith("*28")


def test_a_draft_takes_the_sums_off_and_keeps_the_last_column(tmp_path):
    (run,) = imported(tmp_path, frames())
    text = (tmp_path / "p.yaml").read_text()
    assert "checksum: true\n" in text and "# T: {source: 3" in text
    np.testing.assert_allclose(run.gyro, 3600.0 * GYRO)  # its guess of deg/s


@pytest.mark.parametrize("before", ["", "[2026-03-11 10:15:27.123] "])
def test_rows_with_a_wrong_sum_are_left_out_and_counted(tmp_path, before):
    """A digit that the line changed is a number like any other."""
    lines = [before + line for line in frames()]
    lines[20] = lines[20].replace("PGYRO,20,1", "PGYRO,20,7")
    lines[30] = lines[30][:-1]
    more = "checksum: true\nheader: false\nfields: 4\nreject: {wrong_field_count: true}"
    more = more.replace("4", "5") + '\nline_stamp: "] "' if before else more
    place = 2 if before else 1
    profile = PROFILE.format(separator="comma", more=more, time=place, gyro=place + 1, unit="deg/h")
    (run,) = imported(tmp_path, lines, profile)
    np.testing.assert_array_equal(run.gyro, np.delete(GYRO, [20, 30]))
    assert [f.count for f in run.findings if f.code == "rejected_rows"] == [2]
    with pytest.raises(InputError, match="line 21 has 1"):
        imported(tmp_path, lines, profile.replace("reject: {wrong_field_count: true}", ""))


@pytest.mark.parametrize(
    ("bits", "form"), [(16, "{:04X}"), (16, "0x{:04x}"), (24, "{:06X}"), (64, "{:016X}")]
)
def test_hexadecimal_numbers_are_of_twos_complement(tmp_path, bits, form):
    counts = 200 * (np.arange(COUNT) - 40)
    lines = ["t w", *(f"{i} {form.format(int(c) % 2**bits)}" for i, c in enumerate(counts))]
    profile = PROFILE.format(
        separator="whitespace", more="", time="t", gyro="w", unit=f"count, hex_bits: {bits}"
    )
    (run,) = imported(tmp_path, lines, profile)
    np.testing.assert_array_equal(run.gyro, counts)


def test_what_is_no_number_of_so_many_bits_is_told_and_so_is_the_way_to_read_any(tmp_path):
    lines = ["t w", *(f"{i} {i:04X}" for i in range(COUNT)), f"{COUNT} 1FFFF", f"{COUNT + 1} 0001"]
    profile = PROFILE.format(separator="whitespace", more="", time="t", gyro="w", unit="count, hex_bits: 16")
    with pytest.raises(InputError, match="line 82, column 'w': '1FFFF' is no number"):
        imported(tmp_path, lines, profile)
    with pytest.raises(InputError, match="'000A' is no number; where it is hexadecimal, 'hex_bits: 16'"):
        imported(tmp_path, lines, profile.replace(", hex_bits: 16", ""))
