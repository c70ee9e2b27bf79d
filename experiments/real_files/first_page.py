"""From a laboratory's own file to a judged page: one command, as the file stands."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from experiments.real_files.section import Section, table
from fogml.arrays import FloatArray
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_run
from fogml.runs.writing import write_run

RUNS = ("thermal-cycle-2-x", "thermal-cycle-3-x")
BEGIN = datetime(2026, 3, 2, 23, 59, 30)


def german(path: Path, time_s: FloatArray, gyro: FloatArray, warm: FloatArray) -> None:
    """Title, separator line, unit row, decimal commas, two columns of date and time, footer; UTF-16."""
    lines = ["sep=;", "Prüfstand 4;;;", "Datum;Uhrzeit;Drehrate;Temperatur", ";;°/h;°C"]
    for at, rate, degrees in zip(time_s.tolist(), gyro.tolist(), warm.tolist(), strict=True):
        moment = BEGIN + timedelta(seconds=at)
        numbers = f"{moment:%S.%f};{rate!r};{degrees!r}".replace(".", ",")
        lines.append(f"{moment:%d.%m.%Y};{moment:%H:%M}:{numbers}")
    path.write_text("\r\n".join([*lines, "Ende der Messung;;;", ""]), encoding="utf-16")


def english(path: Path, time_s: FloatArray, gyro: FloatArray, warm: FloatArray) -> None:
    """Comment lines, units in parentheses, a time of day with milliseconds."""
    rows = [
        f"{BEGIN + timedelta(seconds=at):%H:%M:%S.%f},{rate / 3.6!r},{degrees!r}"
        for at, rate, degrees in zip(time_s.tolist(), gyro.tolist(), warm.tolist(), strict=True)
    ]
    path.write_text("\n".join(["# Logger 3", "Time,Gyro (mdps),Coil temp (℃)", *rows, ""]))


def workbook(path: Path, time_s: FloatArray, gyro: FloatArray, warm: FloatArray) -> None:
    """A second sheet with a title and names over two lines."""
    import xlsxwriter

    with xlsxwriter.Workbook(str(path)) as book:
        book.add_worksheet("Info").write_row(0, 0, ["Customer", "ACME"])
        sheet = book.add_worksheet("Data")
        sheet.write_row(0, 0, ["Chamber test"])
        sheet.write_row(2, 0, ["Time\n(s)", "FOG output\n(°/h)", "Temp\n(°C)"])
        for row, values in enumerate(
            zip(time_s.tolist(), gyro.tolist(), warm.tolist(), strict=True), start=3
        ):
            sheet.write_row(row, 0, values)


def struct(path: Path, time_s: FloatArray, gyro: FloatArray, warm: FloatArray) -> None:
    """A MATLAB struct of the writer's own name."""
    from scipy.io import savemat

    savemat(path, {"log": {"time_s": time_s, "gyro_dph": gyro, "temp_C": warm, "note": "bench 4"}})


def pandas(path: Path, time_s: FloatArray, gyro: FloatArray, warm: FloatArray) -> None:
    """Parquet with an index of timestamps."""
    import pandas as pd

    index = pd.Timestamp(BEGIN, tz="UTC") + pd.to_timedelta(time_s, unit="s")
    pd.DataFrame({"gyro_dph": gyro, "temp_C": warm}, index=index.rename("timestamp")).to_parquet(path)


def tdms(path: Path, time_s: FloatArray, gyro: FloatArray, warm: FloatArray) -> None:
    """A rig's channels, with a channel of times."""
    import nptdms

    channels = {"Time": ("s", time_s), "FOG": ("deg/h", gyro), "Coil temperature": ("°C", warm)}
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("Rig", name, values, properties={"unit_string": unit})
                for name, (unit, values) in channels.items()
            ]
        )


def mdf(path: Path, time_s: FloatArray, gyro: FloatArray, warm: FloatArray) -> None:
    """Two channel groups, the thermometer's of every tenth sample."""
    import asammdf

    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(gyro, time_s, unit="°/h", name="FOG_Output")])
        file.append([asammdf.Signal(warm[::10], time_s[::10], unit="°C", name="Temperature")])
        file.save(path)


WRITERS: Mapping[str, tuple[str, str, Callable[..., None]]] = {
    "German spreadsheet export": (".csv", "numpy", german),
    "logger's text": (".csv", "numpy", english),
    "workbook": (".xlsx", "xlsxwriter", workbook),
    "MATLAB struct": (".mat", "scipy", struct),
    "pandas in Parquet": (".parquet", "pandas", pandas),
    "TDMS": (".tdms", "nptdms", tdms),
    "MDF4": (".mf4", "asammdf", mdf),
}
"""What a laboratory has, to suffix, package that writes it, and writer."""


def section(quick: bool) -> Section:
    """Write, train and compare with the run itself."""
    train, test = (shipped_run(name) for name in RUNS)
    with tempfile.TemporaryDirectory() as folder:
        for run in (train, test):
            write_run(run, Path(folder) / f"{run.name}.parquet")
        right = _judged(Path(folder), "run", *(Path(folder) / f"{name}.parquet" for name in RUNS))
        rows, data = [], {}
        for kind, (suffix, package, write) in list(WRITERS.items())[: 2 if quick else None]:
            if find_spec(package) is None:
                continue
            stem = kind.replace(" ", "-").replace("'", "")
            files = [
                _written(Path(folder), f"{stem}-{i}{suffix}", write, run)
                for i, run in enumerate((train, test))
            ]
            found = _judged(Path(folder), stem, *files)
            apart = max(abs(found[key] / right[key] - 1.0) for key in ("before", "after"))
            data[kind] = found | {"relative_difference": apart}
            rows.append([kind, suffix, f"{found['wall_s']:.0f}", found["verdict"], f"{apart:.0e}"])
    markdown = "\n\n".join(
        [
            "## From an own file to a judged page",
            f"**Real recordings** (MEMS, `{RUNS[0]}` to train, `{RUNS[1]}` to test, {len(train)} and "
            f"{len(test)} samples), written as laboratories' programs do and given to "
            "`fogml train A --test B` as they stand: one command, no edit, no profile. The difference is the "
            "largest of bias stability before and after, relative, from that of the runs in the run format "
            f"({right['wall_s']:.0f} s, verdict {right['verdict']}, "
            f"{right['before']:.3g} and {right['after']:.3g} deg/h); the MDF4 file "
            "holds every tenth temperature only.",
            table(["file", "suffix", "time by the clock [s]", "verdict", "difference"], rows),
        ]
    )
    return Section(markdown, {"shipped": right, "files": data})


def _written(folder: Path, name: str, write: Callable[..., None], run: Run) -> Path:
    path = folder / name
    write(path, run.time, run.gyro, run.temperature("T"))
    return path


def _judged(folder: Path, name: str, train: Path, test: Path) -> dict[str, Any]:
    """Verdict and bias stability [deg/h] of ``fogml train``, and what it took by the clock [s]."""
    out = folder / f"judged-{name}"
    began = time.perf_counter()
    command = [sys.executable, "-m", "fogml", "train", train, "--test", test, "--out", out, "--quiet"]
    subprocess.run(command, check=True)
    took = time.perf_counter() - began
    assert (out / "report.html").is_file()
    told = json.loads((out / "report.json").read_text(encoding="utf-8"))
    (judged,) = told["test"]
    stability = {when: judged[when]["bias_stability"] for when in ("before", "after")}
    return {"wall_s": round(took, 1), "verdict": told["verdict"].replace("_", " "), **stability}
