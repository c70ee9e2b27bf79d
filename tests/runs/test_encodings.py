"""Encodings are told by what their text can be in no other; names and units are those that were written."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.runs.encodings import encoding_of
from fogml.runs.profile_draft import draft_profile
from fogml.runs.profiles import import_recording, load_profile
from fogml.runs.reading import read_run

COUNT = 40


@pytest.mark.parametrize(
    ("header", "encoding"),
    [
        ("時刻 [s],ジャイロ [°/h],温度 [℃]", "cp932"),
        ("time [s],gyro [deg/h],T [℃]", "cp932"),  # one sign alone
        ("Время [с],Гироскоп [град/ч],Температура [°С]", "cp1251"),
        ("ВРЕМЯ [s],Гироскоп [deg/h],T [degC]", "cp1251"),
        ("时间 [s],陀螺 [°/h],温度 [℃]", "gb18030"),
        ("时间 [s],速率 [°/h],温度 [℃]", "gb18030"),
        ("Zeit [s],Größe ÄÖÜ [°/h],Spule außen [°C]", "latin-1"),
        ("Temps [s],Vitesse mesurée à l’arrêt [°/h],µ", "cp1252"),
        ("time [s],gyro [°/h],T [°C]", "latin-1"),
        ("time [s],gyro [°/h],T [℃]", "utf-8-sig"),
    ],
)
def test_encodings_of_headers(header, encoding):
    content = f"{header}\n1,2,3\n".encode(encoding)
    found = encoding_of(content, cut=False)
    assert found == {"cp1252": "latin-1"}.get(encoding, encoding)
    assert encoding_of(content + header.encode(encoding)[:-3], cut=True) == found


@pytest.mark.parametrize(
    ("header", "encoding"),
    [
        ("時刻 [s],ジャイロ [°/h],温度 [℃]", "shift_jis"),
        ("Время [с],Гироскоп [град/ч],Температура [°C]", "cp1251"),
    ],
)
def test_a_run_and_its_draft_have_the_columns_that_were_written(tmp_path, header, encoding):
    rows = "".join(f"{i},{9.5 + i * i % 37},{25 + i / 8}\n" for i in range(COUNT))
    path = tmp_path / "a.csv"
    path.write_bytes(f"{header}\n{rows}".encode(encoding))
    (tmp_path / "p.yaml").write_text(draft_profile(path), encoding="utf-8")
    for run in (read_run(path), *import_recording(path, load_profile(tmp_path / "p.yaml"))):
        assert set(run.columns) == {"time", "gyro", "T"}
        np.testing.assert_allclose(run.gyro, 9.5 + np.arange(COUNT) ** 2 % 37)


def test_a_long_file_in_utf_16_that_is_cut_within_a_number_is_noticed(tmp_path):
    rows = [f"{i / 10:.1f},{i % 7}.1234" for i in range(4000)]
    text = f"time [s],gyro [deg/h]\n{chr(10).join(rows)}\n"
    (tmp_path / "a.csv").write_bytes(text.encode("utf-16"))
    assert len(read_run(tmp_path / "a.csv")) == 4000
    (tmp_path / "b.csv").write_bytes(text[:-3].encode("utf-16"))
    with pytest.raises(InputError, match=r"in the middle of a number, '399\.9,2\.12"):
        read_run(tmp_path / "b.csv")
    repaired = read_run(tmp_path / "b.csv", repair=True)
    np.testing.assert_array_equal(repaired.gyro, read_run(tmp_path / "a.csv").gyro[:-1])
