"""One unit's job: done once, its outcome kept beside its results."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from fogml import __version__
from fogml.errors import FogmlError, InputError, in_one_line, quoted
from fogml.fleet.manifest import Unit
from fogml.json_files import read_json, write_json
from fogml.locks import NO_ROOM
from fogml.outputs import folder_to_fill, whole_file
from fogml.processes import heed_interrupt
from fogml.runs.sources import run_sources, sources_stamp
from fogml.strict import Strict, strictly

OUTCOME_SCHEMA, OUTCOME = "fogml.outcome/1", "outcome.json"
FLEET = "fleet.json"
"""What a fleet's units tell together, in the fleet's folder."""
DONE, FAILED = "done", "failed"

UnitJob = Callable[[Unit, Path], Mapping[str, Any]]
"""Does a unit's job, writes the results into a folder, and gives what the fleet wants of them, JSON-ready.

It has to be importable by name: other processes and machines call it.
"""


Positive = Annotated[float, Field(gt=0.0)]
Rms = Annotated[float, Field(ge=0.0, le=1e12)]
"""Rms of a gyro [deg/h]; the bound is far above any rate that turns, and leaves an axis room for its ends."""


class Worst(Strict, extra="ignore"):
    """The run that was judged worst of a unit: its name, averaging time [s] and rms [deg/h]."""

    run: str
    averaging_s: Positive
    before: Rms
    after: Rms
    floor: Rms | None = None
    outside_training: Annotated[float, Field(ge=0.0, le=1.0)] | None = None


class Found(Strict, extra="ignore"):
    """What the fleet wants of a unit's results."""

    model: str = ""
    met: bool | None = None
    verdict: str = ""
    effects: list[str] = []
    notes: list[str] = []
    worst: Worst | None = None
    constants: dict[str, Any] | None = None
    diagnosis: dict[str, Any] | None = None


class Outcome(Strict, extra="ignore"):
    """What is kept of a unit that was done."""

    unit: str
    axis: str
    job: str
    folder: str
    status: Literal["done"]
    fingerprint: str
    found: Found


@dataclass(frozen=True)
class Task:
    """A unit, its job, and where the results go.

    Attributes
    ----------
    unit
        Unit and runs.
    job
        What does it.
    home
        The fleet's folder; on a cluster, one that every machine sees.
    settings
        What results depend on beside the runs, JSON-ready.
    """

    unit: Unit
    job: UnitJob
    home: str
    settings: Mapping[str, Any]

    @property
    def folder(self) -> Path:
        """The unit's own folder."""
        return Path(self.home) / self.unit.folder

    def fingerprint(self) -> str:
        """What tells this task from another: all that its results depend on.

        That is the line of the manifest, the settings, every file that is read for the runs, and the
        version of fogml.
        """
        files = [run_sources(path) for path in (*self.unit.train, *self.unit.test)]
        values = {
            "unit": [self.unit.name, self.unit.job, self.unit.axis, self.unit.fault],
            "covariates": dict(self.unit.covariates),
            "runs": [len(self.unit.train), sources_stamp(file for of_run in files for file in of_run)],
            "settings": self.settings,
            "version": __version__,
        }
        return hashlib.sha256(json.dumps(values, sort_keys=True, default=str).encode()).hexdigest()


def run_task(task: Task) -> dict[str, Any]:
    """Do a unit's job unless its outcome is there already; the outcome.

    What is wrong with one unit becomes a failed outcome; nothing of it is left half-written.

    Raises
    ------
    InputError
        If the disk is full: then other units would fail as well.
    """
    try:
        fingerprint = task.fingerprint()
    except InputError as error:
        return lost(task, str(error))
    held = _held(task)
    if held is not None and (held["unit"], held["axis"]) != (task.unit.name, task.unit.axis):
        whose = f"{held['unit']} {held['axis']}".strip()
        return lost(task, f"{task.folder}: holds the results of {quoted(whose)}; choose another --out")
    known = finished(task, fingerprint)
    if known is not None:
        return known
    outcome = _of_unit(task) | {"fingerprint": fingerprint}
    try:
        if task.unit.fault:
            raise InputError(task.unit.fault)
        # Killed from here on, results would be of this job beside the outcome of another.
        (task.folder / OUTCOME).unlink(missing_ok=True)
        outcome |= {"status": DONE, "found": dict(task.job(task.unit, task.folder))}
    except OSError as error:
        if error.errno in NO_ROOM:
            raise full_disk(task.home, error) from error
        outcome |= {"status": FAILED, "reason": f"{error.filename or ''}: {error.strerror}".lstrip(": ")}
    except FogmlError as error:
        outcome |= {"status": FAILED, "reason": in_one_line(str(error))}
    except Exception as error:
        # Whatever one unit runs into, the others go on.
        outcome |= {"status": FAILED, "reason": f"{type(error).__name__}: {error}"}
    if outcome["status"] == FAILED:
        heed_interrupt()
    try:
        with folder_to_fill(task.folder), whole_file(task.folder / OUTCOME) as partial:
            write_json(partial, outcome, indent=1)
    except OSError as error:
        raise full_disk(task.home, error) from error
    return outcome


def finished(task: Task, fingerprint: str | None = None) -> dict[str, Any] | None:
    """The outcome of a unit that was done before with the same runs and settings; None if it was not.

    Units that failed are tried again, and so are those whose outcome no job has written.
    """
    try:
        held = _held(task)
        return held if held and held["fingerprint"] == (fingerprint or task.fingerprint()) else None
    except InputError:
        return None  # what else is wrong with it the job tells


def _held(task: Task) -> dict[str, Any] | None:
    """The outcome in the unit's folder of a job that was done, of whatever runs, settings and unit."""
    try:
        values: dict[str, Any] = read_json(task.folder / OUTCOME, "run the fleet again")
        strictly(Outcome, values)
    except (InputError, ValueError):
        return None
    return values


def lost(task: Task, reason: str) -> dict[str, Any]:
    """The outcome of a unit whose job could not begin, or ended its process."""
    return _of_unit(task) | {"status": FAILED, "reason": reason}


def _of_unit(task: Task) -> dict[str, Any]:
    """What every outcome begins with."""
    unit = task.unit
    head = {"schema": OUTCOME_SCHEMA, "unit": unit.name, "axis": unit.axis}
    return head | {"job": unit.job, "folder": unit.folder}


def full_disk(home: str, error: OSError) -> InputError:
    """What is said where a fleet's folder takes no more."""
    return InputError(
        f"{home}: cannot be written ({error.strerror or error}); finished units are kept, make room and "
        "run the command again"
    )
