"""Clocks, dropouts and what the numbers give away: each kind of faulty log, and what comes out of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from experiments.real_files.section import Section, table
from fogml.errors import InputError
from fogml.models.names import make_model
from fogml.runs.noise_of_run import noise_report
from fogml.runs.reading import read_run, read_runs
from fogml.runs.run import Run
from fogml.runs.shipped import shipped_names, shipped_run
from fogml.twin.simulate import simulate

N = 0.01
RATE_HZ = 10.0
PROPERTIES = {"gap", "irregular_sampling", "unknown_column", "small_temperature_span", "rejected_rows"}
"""Codes of findings that state a property of a recording, and are no alarm."""
PROGRAMMES = (
    "multi-point-cycle",
    "ten-degrees-per-hour-up",
    "four-positions",
    "joint-staircase",
    "separating",
)
SAMPLE_S = {"tactical": (30.0, 1.0), "navigation": (10.0,), "nominal": (5.0,)}


@dataclass(frozen=True)
class Log:
    """A faulty log: its columns, how it is read, what came out and what is right."""

    name: str
    columns: dict[str, np.ndarray]
    repair: bool
    came_out: str
    right: str


def logs(rows: int) -> Iterator[Log]:
    """Each kind of clock and column, of white noise N = 0.01 deg/sqrt(h) at 10 Hz."""
    index = np.arange(rows)
    time = index / RATE_HZ
    noise = np.random.default_rng(1).normal(0.0, N * 60.0 * np.sqrt(RATE_HZ), rows)
    temperature = 20.0 + 15.0 * (1.0 - np.cos(2.0 * np.pi * index / rows))
    gyro = 7.0 + noise

    def of(times: np.ndarray, unit: str = "s", **changed: np.ndarray) -> dict[str, np.ndarray]:
        return {f"time [{unit}]": times, "gyro [deg/h]": gyro, "T [degC]": temperature, **changed}

    bursts = np.ceil((index + 1) / 5) * 5 / RATE_HZ + (index % 5) * 0.002
    yield Log("bursts of 5 samples", of(bursts), False, "N seven times low", "N, one clock of 0.1 s")
    half = rows // 2
    restart = np.concatenate([time[:half], time[: rows - half] + 0.037])
    yield Log("clock restarted", of(restart), True, "sorted into a mixture", "two runs")
    wrapped = (np.round(time * 1e6) + 2**32 - round(1e6 * time[half])) % 2**32
    yield Log("32 bits of 1 us wrapped", of(wrapped, "us"), True, "sorted into a mixture", "unwrapped")
    wrapped = np.round(time * 1e3) % 2**16
    yield Log("16 bits of 1 ms wrapped", of(wrapped, "ms"), True, "sorted into a mixture", "unwrapped")
    swapped = time.copy()
    swapped[[500, 501]] = swapped[[501, 500]]
    yield Log("two rows swapped", of(swapped), True, "sorted", "sorted")
    yield Log("whole seconds", of(np.floor(time)), True, "90 % of the rows dropped", "all rows, spread")
    coarse = np.floor(index * 0.97) / RATE_HZ
    yield Log("0.097 s in steps of 0.1 s", of(coarse), True, "rows dropped", "all rows, 0.097 s")
    sparse = np.where(index % 10 == 0, temperature, np.nan)
    yield Log(
        "T in every tenth row",
        of(time, **{"T [degC]": sparse}),
        False,
        "90 % of the rows dropped",
        "all rows",
    )
    for sentinel in (-127.0, 85.0, 0.0, -9999.0):
        dropped = temperature.copy()
        dropped[rows // 12 :: rows // 6] = sentinel
        came = "nowhere seen: box, model, flags changed"
        columns = of(time, **{"T [degC]": dropped})
        yield Log(f"T drops out to {sentinel:g}", columns, False, came, "counted, held")


def noise_found(log: Log, folder: Path) -> dict[str, object]:
    """What comes out of a log, by its file."""
    path = folder / "log.csv"
    text = [
        ",".join("" if np.isnan(x) else repr(float(x)) for x in row) for row in zip(*log.columns.values())
    ]
    path.write_text("\n".join([",".join(log.columns), *text]) + "\n", encoding="utf-8")
    refused = None
    try:
        read_run(path)
    except InputError as error:
        refused = str(error).partition("; it must strictly increase: ")[2] or str(error)
    runs = read_runs(path, repair=log.repair)
    report = noise_report(runs[0])["terms"]["N"]
    return {
        "log": log.name,
        "without_repair": refused,
        "runs": len(runs),
        "rows": sum(len(run) for run in runs),
        "of_rows": len(log.columns["gyro [deg/h]"]),
        "sample_s": runs[0].sample_s,
        "N": report["value"],
        "said": [f.message for f in runs[0].findings if f.code not in PROPERTIES],
        "came_out": log.came_out,
        "right": log.right,
    }


def box_found(rows: int) -> list[dict[str, object]]:
    """The trained box with and without dropouts."""
    time = np.arange(float(rows))
    temperature = 20.0 + 40.0 * np.sin(np.pi * time / rows) ** 2
    gyro = 5.0 + 0.05 * temperature + np.random.default_rng(0).normal(0.0, 0.3, rows)
    found = []
    for sentinel in (None, -127.0, 85.0, 0.0, -9999.0):
        dropped = temperature.copy()
        if sentinel is not None:
            dropped[[50, rows // 3, rows // 2]] = sentinel
        run = Run("run", {"time": time, "gyro": gyro, "T": dropped})
        model = make_model("polynomial", features="T, dT").fit(run)
        low, high = model.card_.box["T"]
        flagged = int(np.count_nonzero(model.compensate(run).flag[[50, rows // 3, rows // 2]]))
        found.append({"sentinel": sentinel, "low": low, "high": high, "flagged": flagged})
    return found


def given_away() -> list[dict[str, object]]:
    """What is said of a run whose sign or unit is wrong."""
    sound = simulate("multi-point-cycle", "tactical", sample_s=10.0, seed=11).run

    def changed(**columns: np.ndarray) -> Run:
        return Run("run", {**sound.columns, **columns}, sound.facts)

    turned = 100.0 * np.sign(np.sin(np.arange(len(sound)) / 40.0))
    cases: dict[str, Callable[[], Run]] = {
        "sound": lambda: sound,
        "other sign": lambda: changed(gyro=-sound.gyro),
        "deg/s as deg/h": lambda: changed(gyro=sound.gyro / 3600.0),
        "deg/h as deg/s": lambda: changed(gyro=sound.gyro * 3600.0),
        "T_in in kelvin": lambda: changed(T_in=sound.columns["T_in"] + 273.15),
        "T_in in Fahrenheit": lambda: changed(T_in=1.8 * sound.columns["T_in"] + 32.0),
        "T_out 150 degC off": lambda: changed(T_out=sound.columns["T_out"] + 150.0),
        "table rate of the other sign": lambda: changed(rate=turned, gyro=sound.gyro - 3600.0 * turned),
        "compensated, by its facts": lambda: Run(
            "run", sound.columns, sound.facts.model_copy(update={"compensated": True})
        ),
    }
    from fogml.runs.checks import check_run

    return [
        {"case": name, "said": [f.message for f in check_run(make()) if f.code not in PROPERTIES][:2]}
        for name, make in cases.items()
    ]


def alarms(quick: bool) -> list[dict[str, object]]:
    """What is warned of recordings and simulated runs that are sound."""
    from fogml.runs.checks import check_run

    found = []
    for name in shipped_names():
        run = shipped_run(name)
        found.append((f"shipped {name}", run.findings))
    for twin, intervals in SAMPLE_S.items():
        for sample_s in intervals if not quick else intervals[:1]:
            for programme in PROGRAMMES if not quick else PROGRAMMES[:1]:
                run = simulate(programme, twin, sample_s=sample_s, seed=3).run
                found.append((f"{programme}, {twin}, {sample_s:g} s", check_run(run)))
    counted = [(name, Counter(f.code for f in said if f.code not in PROPERTIES)) for name, said in found]
    return [{"run": name, "warned": dict(codes)} for name, codes in counted]


def section(quick: bool) -> Section:
    """All of it."""
    rows = 12_000 if quick else 36_000
    with TemporaryDirectory() as folder:
        found = [noise_found(log, Path(folder)) for log in logs(rows)]
    boxes, away, warned = box_found(3600), given_away(), alarms(quick)
    clocks = table(
        [
            "log",
            "came out before",
            "right",
            "rows",
            "runs",
            "interval [s]",
            "N (truth 0.0100)",
            "without `--repair`",
        ],
        [
            [
                *(f[key] for key in ("log", "came_out", "right")),
                f"{f['rows']} of {f['of_rows']}",
                f["runs"],
                f"{f['sample_s']:.6g}",
                f"{f['N']:.4f}" if f["N"] is not None else "–",
                f["without_repair"] or "read, and said",
            ]
            for f in found
        ],
    )
    said = table(["log", "said"], [[f["log"], "; ".join(f["said"]) or "nothing"] for f in found])
    box = table(
        ["dropout to", "box of T [degC]", "dropouts flagged"],
        [[b["sentinel"], f"{b['low']:.2f} to {b['high']:.2f}", f"{b['flagged']} of 3"] for b in boxes],
    )
    told = table(["run", "said first"], [[a["case"], "; ".join(a["said"]) or "nothing"] for a in away])
    quiet = [w for w in warned if not w["warned"]]
    alarm = table(
        ["run", "warned"],
        [
            [w["run"], ", ".join(f"{code} {count}" for code, count in w["warned"].items())]
            for w in warned
            if w["warned"]
        ],
    )
    markdown = f"""## Clocks, dropouts and what the numbers give away

White noise of N = 0.0100 deg/√h at 10 Hz over a cycle of temperature, written as a log whose clock or
columns are at fault, read with `--repair` where it needs that; its noise is that of the file's first run.

{clocks}

{said}

Three dropouts among {3600} samples, none in the first row: the trained box, and the flags of these samples.

{box}

A simulated run (`multi-point-cycle`, tactical, one sample in 10 s) with a sign or unit changed:

{told}

What is warned of sound data: {len(quiet)} of {len(warned)} recordings and simulated runs have no
warning. The others hold single samples that stand out, or a column that stays at one value:

{alarm}
"""
    return Section(markdown, {"logs": found, "boxes": boxes, "given_away": away, "alarms": warned})
