"""Spoiled inputs of every kind end as they must; and the examination sees the faults that it looks for."""

from __future__ import annotations

import ctypes
import json
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from experiments.faults.batches import outcomes, sandbox
from experiments.faults.case import Case
from experiments.faults.fuzz import drawn, fuzz
from experiments.faults.independent import compare
from experiments.faults.inputs import KINDS
from experiments.faults.mutate import MARKER
from experiments.faults.sandbox import FAULTS, Limits, Outcome

RUN = b"time [s],gyro [deg/h],T [degC]\n" + b"".join(b"%d,%d.5,25\n" % (10 * k, k % 3) for k in range(40))

INPUTS = 150
LIMITS = Limits(cpu_s=30.0, wall_s=120.0)


@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_spoiled_inputs(tmp_path: Path) -> None:
    found = fuzz(INPUTS, seed=11, limits=LIMITS, kept=tmp_path, quick=True)
    assert found["inputs"] >= INPUTS
    faults = {
        f"{kind}: {fault}": counts[fault] for kind, counts in found["kinds"].items() for fault in FAULTS
        if fault in counts
    }  # fmt: skip
    told = [path.read_text() for path in sorted(tmp_path.rglob("case.json"))][:3]
    assert not faults, told
    assert sum(counts.get("compared", 0) for counts in found["kinds"].values()) > INPUTS / 20


def test_the_same_seed_draws_the_same_inputs() -> None:
    world = {"a.csv": RUN, "b.csv": RUN, "a.yaml": b"unit: F\n"}
    kinds = [
        kind for kind in KINDS if kind.name in ("CSV run", "side file", "feature text", "import profile")
    ]
    world |= {"simulated.csv": RUN, "imported/log-1-x.csv": RUN, "log.txt": b"x\n"}
    for index in range(50):
        first, again, other = (drawn(seed, index, world, kinds)[1] for seed in (1, 1, 2))
        assert first == again
        assert first != other


def planted(home: Path, what: str, limits: Limits) -> Outcome:
    """A command with a planted fault."""
    import fogml.runs.reading as reading

    box = sandbox(home, limits, compare)
    whole = reading.read_runs

    def faulty(path: str | Path, **options: object) -> object:
        if what == "traceback":
            raise KeyError("planted")
        if what == "crash":
            ctypes.string_at(0)
        if what == "hang":
            time.sleep(300.0)
        while what == "busy":
            pass
        if what == "memory":
            _ = bytearray(300 << 20)
        if what == "noise":
            os.write(2, b"planted\n")
        if what == "message":
            print("planted", file=sys.stdout)
            return whole(Path("nowhere.csv"))
        if what == "left":
            Path(".partial-x").touch()
        if what == "input changed":
            Path(path).write_bytes(RUN[:-4])
            return whole(Path("nowhere.csv"))
        if what == "ran code":
            Path(MARKER).touch()
        if what == "not finite":
            Path("x.json").write_text('{"rms": NaN}')
        (run,) = whole(path, **options)
        changed = replace(run, columns={**run.columns, "gyro": run.gyro * 1.001})
        return [changed if what == "silent change" else run]

    reading.read_runs = box.noted(faulty)
    try:
        return box.judged(Case(("inspect", "x.csv", "--quiet"), {"x.csv": RUN}, "x.csv"))
    finally:
        reading.read_runs = whole


@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
@pytest.mark.parametrize("what", [*FAULTS, "busy", "nothing"])
def test_a_planted_fault_is_seen(what: str, tmp_path: Path) -> None:
    def do(index: int, home: Path) -> Outcome:
        return planted(home, what, limits)

    limits = Limits(1.0 if what == "busy" else 60.0, 1.0 if what == "hang" else 240.0, 200 << 20)
    ((index, outcome),) = outcomes(1, do, tmp_path, limits)
    assert index == 0
    assert set(outcome.faults) == {"busy": {"hang"}, "nothing": set()}.get(what, {what}), json.dumps(
        outcome.faults
    )
    if what == "nothing":
        assert (outcome.status, outcome.compared) == (0, True)


@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_the_cases_after_a_crash_are_done(tmp_path: Path) -> None:
    def do(index: int, home: Path) -> Outcome:
        if index == 1:
            os.abort()
        return Outcome(0)

    found = dict(outcomes(4, do, tmp_path, Limits()))
    assert {index for index, outcome in found.items() if outcome.faults} == {1}
    assert set(found) == {0, 1, 2, 3}
