"""Many spoiled inputs, seeded: what is counted of them, and the inputs that failed kept as files."""

from __future__ import annotations

import functools
import json
import math
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from random import Random
from typing import Any

from experiments.faults.batches import outcomes, sandbox
from experiments.faults.case import Case
from experiments.faults.containers import FOLDER
from experiments.faults.independent import compare
from experiments.faults.inputs import KINDS, Kind
from experiments.faults.sandbox import Limits, Outcome
from experiments.faults.world import make_world, recordings_alone

_SHOWN_EVERY_S = 20.0
_MOST_KEPT = 5
"""Failing inputs kept of each kind and fault."""


def drawn(seed: int, index: int, world: Mapping[str, bytes], kinds: Sequence[Kind]) -> tuple[Kind, Case]:
    """The input of a number: the same for the same seed, whatever else is drawn."""
    rng = Random(f"{seed}/{index}")
    (kind,) = rng.choices(kinds, [kind.share for kind in kinds])
    return kind, kind.make(rng, world)


def fuzz(
    inputs: int,
    seed: int,
    *,
    workers: int = 1,
    limits: Limits | None = None,
    kept: Path | None = None,
    quick: bool = False,
    only: Sequence[str] = (),
    most_s: float = math.inf,
    progress: bool = False,
) -> dict[str, Any]:
    """Spoil inputs, run them, and count.

    Parameters
    ----------
    inputs
        How many.
    seed
        Of all draws.
    workers
        Processes.
    limits
        What an input may take.
    kept
        Folder for inputs that fail.
    quick
        Without the kinds whose sound inputs take long to make.
    only
        Names of kinds; all by default.
    most_s
        Time after which no more is done [s].
    progress
        Say how far it is, on stderr.
    """
    limits = limits or Limits()
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="fogml-faults-") as name:
        sound = Path(name) / "sound"
        kinds = [kind for kind in KINDS if not only or kind.name in only]
        alone = all(kind.needs.startswith(FOLDER) for kind in kinds)
        world = recordings_alone(sound) if alone else make_world(sound, quick=quick)
        kinds = [kind for kind in kinds if any(file.startswith(kind.needs) for file in world)]
        tally = Tally(limits, seed)
        do = functools.partial(_one, seed, world, kinds, limits)
        shown = began
        notes = []
        try:
            for index, outcome in outcomes(inputs, do, Path(name), limits, workers=workers):
                if time.monotonic() - began > most_s:
                    break
                kind, case = drawn(seed, max(index, 0), world, kinds)
                tally.note(kind.name, outcome)
                if kept is not None and outcome.faults:
                    _keep(kept, kind.name, index, case, outcome)
                if progress and time.monotonic() - shown > _SHOWN_EVERY_S:
                    shown = time.monotonic()
                    print(
                        f"{tally.inputs} of {inputs}, {shown - began:.0f} s: {tally.line()}",
                        file=sys.stderr,
                        flush=True,
                    )
        except Exception as error:  # a fault of the examination itself loses no count
            notes = [f"The examination itself ended early: {error!r}."]
    return tally.values(time.monotonic() - began) | {"notes": notes, "only": [*only]}


def _one(
    seed: int, world: Mapping[str, bytes], kinds: Sequence[Kind], limits: Limits, index: int, home: Path
) -> Outcome:
    # Drawn before output is caught: what makes the input is no part of what is judged.
    _, case = drawn(seed, index, world, kinds)
    return sandbox(home, limits, compare).judged(case)


class Tally:
    """Counts per kind of input."""

    def __init__(self, limits: Limits, seed: int) -> None:
        self.limits, self.seed = limits, seed
        self.counts: dict[str, Counter[str]] = {}

    @property
    def inputs(self) -> int:
        """How many were counted."""
        return sum(count["inputs"] for count in self.counts.values())

    def note(self, kind: str, outcome: Outcome) -> None:
        """Count one."""
        count = self.counts.setdefault(kind, Counter())
        count["inputs"] += 1
        count["milliseconds"] += round(1000.0 * outcome.seconds)
        count["compared"] += outcome.compared
        count[f"exit {outcome.status}" if outcome.status in (0, 1, 2) else "no exit of these"] += 1
        for fault in outcome.faults:
            count[fault] += 1

    def line(self) -> str:
        """All faults in one line."""
        total: Counter[str] = sum(self.counts.values(), Counter())
        del total["milliseconds"]
        return ", ".join(f"{name} {number}" for name, number in sorted(total.items()))

    def values(self, seconds: float) -> dict[str, Any]:
        """The counts, JSON-ready."""
        return {
            "seed": self.seed,
            "inputs": self.inputs,
            "seconds": round(seconds),
            "limits": {
                "cpu_s": self.limits.cpu_s, "wall_s": self.limits.wall_s,
                "memory_bytes": self.limits.memory_bytes,
            },
            "kinds": {kind: dict(self.counts[kind]) for kind in sorted(self.counts)},
        }  # fmt: skip


def _keep(kept: Path, kind: str, index: int, case: Case, outcome: Outcome) -> None:
    """Write an input that failed, with its command, to be run again."""
    home = kept / kind.replace(" ", "-").replace("'", "") / min(outcome.faults).replace(" ", "-")
    if home.is_dir() and len(list(home.iterdir())) >= _MOST_KEPT:
        return
    folder = home / f"{index}"
    for name, content in case.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    folder.mkdir(parents=True, exist_ok=True)
    told = {
        "command": case.command,
        "spoiled": case.spoiled,
        "status": outcome.status,
        "faults": outcome.faults,
    }
    (folder / "case.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
