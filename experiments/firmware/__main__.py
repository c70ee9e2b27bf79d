"""Exported C on simulated units, sample by sample, beside the model over the whole recording.

``python -m experiments.firmware`` writes ``results.json`` and ``results.md`` beside itself. The lengths are
``--hours-100-hz``, ``--hours-1-khz``, ``--days-1-hz`` and ``--samples``. Everything is synthetic.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter1d

from experiments.firmware.units import (
    FEATURES,
    NOISE_DEGC,
    Unit,
    blocks,
    code_of,
    temperatures,
    trained_model,
)
from experiments.results import write_results
from fogml import __version__
from fogml.export.c_program import cortex_m4_size, instructions_per_sample
from fogml.export.c_source import C_DTYPES, CSource, c_source
from fogml.export.false_readings import false_readings
from fogml.export.plan import Plan
from fogml.models.base import DriftModel
from fogml.models.compensation import compensate_blocks
from fogml.runs.run import Run

HERE = Path(__file__).parent
_SIZES = ("ram_bytes", "flash_bytes", "library_flash_bytes", "instructions_per_sample")
WITHIN = 129
"""Samples that the windows hold, and the one that is told."""
SENTINELS = (-127.0, 85.0, 0.0, 999.0, -9999.0, np.nan)
"""What thermometers show that are cut off, starting or shorted [degC]."""


def beside_the_model(
    model: DriftModel, units: list[Unit], seconds: float, sample_s: float, origin_us: int = 0
) -> list[dict[str, Any]]:
    """Of each unit the largest difference at flag 0, flags that differ, and counts of flags."""
    step_us = round(sample_s * 1e6)
    found: list[dict[str, Any]] = [
        {
            "dtype": unit.dtype,
            "code": unit.code,
            "seconds": seconds,
            "largest_difference": 0.0,
            "flags_differ": 0,
        }
        for unit in units
    ]
    flags = np.zeros(3, dtype=np.int64)

    def recorded() -> Iterator[Run]:
        for time, T in blocks(seconds, sample_s, 5):
            yield Run.derived("unit", {"time": time, "gyro": np.zeros(len(time)), "T": T})

    for block, expected in compensate_blocks(model, recorded()):
        flags += np.bincount(expected.flag, minlength=3)
        for unit, row in zip(units, found):
            start = origin_us + round(float(block.time[0]) * 1e6)
            out, flag = unit.feed(start, step_us, block.columns["T"], block.gyro)
            good = (flag == 0) & (expected.flag == 0)
            off = float(np.abs(out - expected.compensated)[good].max(initial=0.0))
            row["largest_difference"] = max(row["largest_difference"], off)
            row["flags_differ"] += int(np.count_nonzero(flag != expected.flag))
    return [row | {"flags": flags.tolist()} for row in found]


def with_faults(model: DriftModel, units: list[Unit], count: int) -> Any:
    """What is wrong at flag 0 of samples among which thermometers fail, beside those without a fault."""
    rng = np.random.default_rng(17)
    time = np.arange(float(count))
    clean = temperatures(time, 7)
    T = clean.copy()
    begins = 60 + rng.choice(count - 200, count // 200, replace=False)
    for begin in begins.tolist():
        length = int(rng.choice([1, 2, 10, 60], p=[0.6, 0.2, 0.15, 0.05]))
        kind = rng.random()
        if kind < 0.5:
            T[begin : begin + length] = rng.choice(SENTINELS)
        elif kind < 0.75:
            T[begin : begin + length] = rng.uniform(-300.0, 300.0, length)[: len(T[begin : begin + length])]
        else:
            T[begin : begin + length] += rng.choice([-1.0, 1.0]) * rng.uniform(0.0, 60.0)
    fault = ~(clean == T)
    expected = model.compensate(Run.derived("clean", {"time": time, "gyro": 0.0 * time, "T": clean}))
    # What is stated of false readings that pass: by how long none was good before, within the windows' reach.
    plan = Plan.of(model, 1.0)
    told = false_readings(plan)
    assert told is not None
    seconds = np.array([row["missing_s"] for row in told["largest_error"]])
    rows = []
    for unit in units:
        out, flag = unit.feed(0, 1_000_000, T, np.zeros(count))
        off, good = np.abs(out - expected.compensated), flag == 0
        passed = fault & good
        since = np.arange(count) - np.maximum.accumulate(np.where(flag == 2, 0, np.arange(count)))
        missing = np.append(0, np.maximum(since[:-1], 0))
        in_reach = maximum_filter1d(np.where(passed, missing, -1), WITHIN, origin=(WITHIN - 1) // 2)
        stated = np.array([row["spell_deg_h"] for row in told["largest_error"]])
        bound = np.where(in_reach < 0, 0.0, stated[np.searchsorted(seconds, np.maximum(in_reach, 0))])
        beyond = good & (off > bound + model.intervals_.half_width(0.9))
        rows.append(
            {
                "dtype": unit.dtype,
                "largest_at_flag_0": float(off[good & (in_reach < 0)].max(initial=0.0)),
                "largest_after_faults_that_pass": float(off[good & (in_reach >= 0)].max(initial=0.0)),
                "rms_after_faults_that_pass": float(np.sqrt(np.mean(off[good & (in_reach >= 0)] ** 2))),
                "share_flagged": float(np.mean(~good)),
                "faults_at_flag_0": int(np.count_nonzero(passed)),
                "largest_offset_at_flag_0": float(np.abs(T - clean)[passed].max(initial=0.0)),
                "beyond_what_is_stated": int(np.count_nonzero(beyond)),
            }
        )
    return {"samples": count, "faults": int(fault.sum()), "stated": told, "units": rows}


RATES = {
    "100 Hz": (0.01, C_DTYPES, ()),
    "1 kHz": (0.001, C_DTYPES, ()),
    "1 Hz": (1.0, ("float32",), ("-DFOGML_CLOCK_32",)),
}
"""Sample interval [s], number formats and options of the compiler by rate."""


def main() -> int:
    """Measure, write and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--hours-100-hz", type=float, default=48.0)
    parser.add_argument("--hours-1-khz", type=float, default=48.0)
    parser.add_argument("--days-1-hz", type=float, default=365.0)
    parser.add_argument("--samples", type=int, default=1_000_000)
    parts = (*RATES, "faults", "sizes")
    parser.add_argument(
        "--only", nargs="*", choices=parts, default=parts, help="others stay as results.json has them"
    )
    parser.add_argument("--formats", nargs="*", choices=C_DTYPES, default=C_DTYPES)
    asked = parser.parse_args()
    lengths = 3600.0 * np.array([asked.hours_100_hz, asked.hours_1_khz, 24.0 * asked.days_1_hz])
    model = trained_model()
    held = (
        json.loads((HERE / "results.json").read_text())
        if set(asked.only) < set(parts) or set(asked.formats) < set(C_DTYPES)
        else {}
    )
    result = {
        "fogml": __version__,
        "data": "synthetic",
        "features": FEATURES,
        "half_width_90_deg_h": float(model.intervals_.half_width(0.9)),
        "cases": held.get("cases", {}),
        "faults": held.get("faults"),
        "sizes": held.get("sizes"),
    }
    for (name, (sample_s, dtypes, flags)), seconds in zip(RATES.items(), lengths.tolist(), strict=True):
        if name in asked.only:
            wanted = [dtype for dtype in dtypes if dtype in asked.formats]
            units = [Unit(c_source(Plan.of(model, sample_s), dtype, []), *flags) for dtype in wanted]
            # The clock begins at Unix time.
            rows = beside_the_model(model, units, seconds, sample_s, 1_764_000_000_000_000)
            print(name, rows, flush=True)
            result["cases"][name] = joined(result["cases"].get(name, []), rows)
    if "faults" in asked.only:
        units = [Unit(c_source(Plan.of(model, 1.0), dtype, [])) for dtype in C_DTYPES]
        result["faults"] = with_faults(model, units, asked.samples)
    if "sizes" in asked.only:
        result["sizes"] = {
            name: {dtype: sizes(c_source(Plan.of(model, sample_s), dtype, [])) for dtype in dtypes}
            for name, (sample_s, dtypes, _) in RATES.items()
        }
    page = _page(result)
    write_results(HERE, result, page)
    print(page)
    return 0


def joined(held: list[dict[str, Any]], found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows of a rate: found ones in place of those held, save what ran longer by other code."""
    by_dtype = {row["dtype"]: row for row in found}

    def stays(row: dict[str, Any]) -> bool:
        new = by_dtype.get(row["dtype"])
        return new is None or (row["code"] != new["code"] and row["seconds"] > new["seconds"])

    rows = [*found, *filter(stays, held)]
    return sorted(rows, key=lambda row: (C_DTYPES.index(row["dtype"]), row["seconds"]))


def sizes(source: CSource) -> dict[str, Any] | None:
    """Bytes and instructions of a sample on a Cortex-M4, and of which code; None without its compiler."""
    with tempfile.TemporaryDirectory() as name:
        size = cortex_m4_size(source, Path(name))
        if size is not None:
            size["instructions_per_sample"] = instructions_per_sample(source, Path(name))
            size["code"] = code_of(source)
        return size


def _page(result: dict[str, Any]) -> str:
    lines = [
        "# Exported C over days, a year and a million samples with faults",
        "",
        f"Synthetic. Model: polynomial of {result['features']} with one thermometer, which shows steps of "
        f"1/256 °C with {NOISE_DEGC * 1e3:g} m°C of noise; its 90 % half-width is "
        f"{result['half_width_90_deg_h']:.3g} deg/h. Clocks begin at Unix time in microseconds; at 1 Hz they "
        "are 32-bit and wrap every 71.6 minutes. Sizes are bytes on a Cortex-M4 (arm-none-eabi-gcc -Os), "
        "instructions those of its code for one sample (-O2), counted in an emulator. Code is a hash of the "
        "C without self-test, comments and numbers: of what ran, and of what was measured if it is another; "
        "a longer run by other code stays beside a shorter one.",
        "",
        "| rate | length | format | largest difference at flag 0 [deg/h] | flags that differ | "
        "samples with flag 0, 1, 2 | RAM | flash | of the compiler's library | instructions | code |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, case in result["cases"].items():
        for row in case:
            hours = row["seconds"] / 3600.0
            length = f"{hours:g} h" if hours < 1000.0 else f"{hours / 24.0:g} days"
            size = result["sizes"][name][row["dtype"]] or dict.fromkeys((*_SIZES, "code"), "–")
            codes = dict.fromkeys((row["code"], size["code"]))
            counts = ", ".join(str(count) for count in row["flags"])
            lines.append(
                f"| {name} | {length} | {row['dtype']} | {row['largest_difference']:.2g} "
                f"| {row['flags_differ']} | {counts} | {size['ram_bytes']} | {size['flash_bytes']} "
                f"| {size['library_flash_bytes']} | {size['instructions_per_sample']} | {', '.join(codes)} |"
            )
    faults = result["faults"]
    told = faults["stated"]
    stated = "; ".join(
        f"{row['one_deg_h']:.2g} deg/h by one, {row['spell_deg_h']:.2g} deg/h by a spell, each off by up to "
        f"{row['off_degC']:.2g} °C"
        + (f", after {row['missing_s']:g} s without a good one" * (row["missing_s"] > 0))
        for row in told["largest_error"]
    )
    lines += [
        "",
        f"Faults: {faults['samples']} samples at 1 Hz, {faults['faults']} of them readings that are none "
        "(sentinels, drawn values, offsets up to 60 °C; alone or up to a minute long), beside the model on "
        f"the same without them. The header believes readings within {told['step_degC']:.2g} °C and "
        f"{told['rate_degC_s']:.2g} °C/s of the last good one, as trained, and states what false ones that "
        f"pass can do: {stated}.",
        "",
        "| format | false readings at flag 0 | off by up to [°C] | largest error at flag 0 without them in "
        "windows [deg/h] | ... with them | ... RMS | samples beyond what is stated | flagged |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['dtype']} | {row['faults_at_flag_0']} | {row['largest_offset_at_flag_0']:.2g} "
        f"| {row['largest_at_flag_0']:.2g} | {row['largest_after_faults_that_pass']:.2g} "
        f"| {row['rms_after_faults_that_pass']:.2g} | {row['beyond_what_is_stated']} "
        f"| {row['share_flagged']:.1%} |"
        for row in faults["units"]
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    raise SystemExit(main())
