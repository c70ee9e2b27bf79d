"""The result of planning: runs, what they are expected to tell, runners-up; and all that as ``plan.json``."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.planning.fisher import Criterion
from fogml.gap.planning.lab import Lab
from fogml.gap.planning.rehearsal import COARSE_S, FINE_S, Rehearsal
from fogml.gap.planning.separating import LEAST_DISTANCE, least_of
from fogml.gap.result_parts import Rehearsed
from fogml.runs.facts import Facts
from fogml.signals.noise_model import NoiseModel
from fogml.twin.programme import Programme
from fogml.twin.schedule import Track
from fogml.twin.twin import Twin

_BETTER = 0.9


@dataclass(frozen=True)
class ExpectedError:
    """What a plan promises of one wanted parameter.

    Attributes
    ----------
    name, unit
        A constant, or ``effect.amplitude`` or ``effect.parameter``.
    usual
        Its value in the plan.
    prior
        Standard deviation beforehand; None for an amplitude.
    se
        Expected standard error, of an effect's shape the root mean square over shapes as the catalogue
        spreads them about the plan's; None where the runs don't show it.
    """

    name: str
    unit: str
    usual: float
    prior: float | None
    se: float | None

    @property
    def shown(self) -> bool:
        """Whether it is known a tenth better than before, or an amplitude of its usual size shows."""
        if self.se is None:
            return False
        if self.prior is None:
            return self.se * LEAST_DISTANCE <= abs(self.usual)
        return self.se <= _BETTER * self.prior


@dataclass(frozen=True, eq=False)
class Separation:
    """How far apart a plan pulls effects: each (row) from each other (column), lengths on the diagonal."""

    members: tuple[str, ...]
    pairs: FloatArray

    @property
    def distance(self) -> float:
        """The least distance over pairs, or the length of a single one."""
        return least_of(self.pairs)

    @property
    def enough(self) -> bool:
        """Whether they can be told apart."""
        return self.distance >= LEAST_DISTANCE


@dataclass(frozen=True, eq=False)
class Outlook:
    """What runs are expected to tell.

    Attributes
    ----------
    errors
        Of the wanted parameters.
    correlations
        Between them, shape (wanted, wanted).
    separations
        Of the groups to be told apart.
    """

    errors: tuple[ExpectedError, ...]
    correlations: FloatArray
    separations: tuple[Separation, ...]


@dataclass(frozen=True, eq=False)
class PlannedRun:
    """One run of a plan.

    Attributes
    ----------
    programme, summary
        What to do, and in words.
    facts
        Of the set-up, the mounting among them.
    outlook
        After this run and those before it.
    alternatives
        Other programmes in its place, with their summaries and outlooks.
    rehearsal
        A rehearsal of it.
    """

    programme: Programme
    summary: str
    facts: Facts
    outlook: Outlook
    alternatives: tuple[tuple[Programme, str, Outlook], ...]
    rehearsal: Rehearsal


@dataclass(frozen=True, eq=False)
class Plan:
    """The result of `fogml.gap.planning.plan.plan_runs`.

    Attributes
    ----------
    twin, grade
        Whose responses were planned with.
    criterion
        ``D`` or ``A``.
    hours
        Longest time of a run [h].
    limits
        Lowest and highest temperature [degC].
    noise
        Of the gyro.
    lab
        What chamber, table and fixture can do.
    acting
        The twin that was planned with, without noise: with the heat that was assumed where it states none.
    runs
        In order; the last one's outlook is the plan's.
    assumed
        What was assumed, in words.
    rehearsal
        What a diagnosis of all runs would name of each candidate, where that was asked for.
    """

    twin: str
    grade: str
    criterion: Criterion
    hours: float
    limits: tuple[float, float]
    noise: NoiseModel
    lab: Lab
    acting: Twin
    runs: tuple[PlannedRun, ...]
    assumed: tuple[str, ...]
    rehearsal: tuple[Rehearsed, ...] = ()

    @property
    def outlook(self) -> Outlook:
        """What is expected of all runs together."""
        return self.runs[-1].outlook


SCHEMA = "fogml.plan/1"
_MOST_POINTS = 600


def programme_file(number: int) -> str:
    """Name of the file of a plan's run, counted from 0."""
    return "programme.yaml" if number == 0 else f"programme-{number + 1}.yaml"


def simulation_file(number: int) -> str:
    """Name of the file that `fogml simulate` takes for a plan's run, counted from 0."""
    return "simulation.yaml" if number == 0 else f"simulation-{number + 1}.yaml"


def plan_values(plan: Plan) -> dict[str, Any]:
    """The content of ``plan.json``, schema ``fogml.plan/1``."""
    return {
        "schema": SCHEMA,
        "twin": plan.twin,
        "grade": plan.grade,
        "data": "synthetic: expected from the twin's responses and noise, nothing was measured",
        "criterion": plan.criterion,
        "hours": plan.hours,
        "total_hours": sum(run.programme.total_hours for run in plan.runs),
        "limits_degC": list(plan.limits),
        "fastest_ramp_degC_min": plan.lab.fastest_ramp,
        "fastest_turn_deg_s": plan.lab.fastest_turn,
        "noise": {"N": plan.noise.N, "B": plan.noise.B, "K": plan.noise.K},
        "sample_s": {"search": COARSE_S, "figures": FINE_S},
        "least_distance": LEAST_DISTANCE,
        **_outlook(plan.outlook),
        "runs": [_run(number, run) for number, run in enumerate(plan.runs)],
        "rehearsal": [{**asdict(r), "named_as": list(r.named_as)} for r in plan.rehearsal],
        "assumed": list(plan.assumed),
    }


def _run(number: int, run: PlannedRun) -> dict[str, Any]:
    return {
        "programme": programme_file(number),
        "simulation": simulation_file(number),
        "summary": run.summary,
        "hours": run.programme.total_hours,
        "input_axis": run.facts.as_dict().get("input_axis"),
        **_outlook(run.outlook),
        "alternatives": [
            {
                "summary": summary,
                "hours": programme.total_hours,
                **_outlook(outlook),
                "programme": programme.as_dict(),
            }
            for programme, summary, outlook in run.alternatives
        ],
        "profile": profile(run.programme)
        | {"coil": _thinned(run.rehearsal.rows.time_s, run.rehearsal.rows.temperature)},
    }


def _outlook(outlook: Outlook) -> dict[str, Any]:
    return {
        "wanted": [
            {
                "name": e.name,
                "unit": e.unit,
                "usual": e.usual,
                "prior_se": e.prior,
                "se": e.se,
                "shown": e.shown,
            }
            for e in outlook.errors
        ],
        "correlations": np.round(outlook.correlations, 6).tolist(),
        "separations": [
            {
                "separates": list(s.members),
                "distance": s.distance,
                "enough": s.enough,
                "lengths": {id: float(s.pairs[i, i]) for i, id in enumerate(s.members)},
                "pairs": [
                    {"true": a, "taken_for": b, "distance": float(s.pairs[i, j])}
                    for i, a in enumerate(s.members)
                    for j, b in enumerate(s.members)
                    if i != j
                ],
            }
            for s in outlook.separations
        ],
    }


def profile(programme: Programme) -> dict[str, Any]:
    """What a programme does over time: set point [degC], table rate [deg/s], switches, yaw [deg].

    Each as times [s] and values; set point and rate are linear in between, the others hold.
    """
    schedule = programme.schedule
    told = {"set_point": _knots(schedule.set_point), "table_rate": _knots(schedule.table_rate)}
    for what in ("power", "fan", "compressor", "yaw"):
        track = schedule.settings[what]
        if len(track.times) > 1:
            told[what] = _knots(track)
    return told


def _knots(track: Track) -> dict[str, list[float | None]]:
    return {
        "time_s": [max(time, 0.0) for time in track.times],
        # What is left to the chamber has no value of its own.
        "value": [None if math.isnan(value) else value for value in track.values],
    }


def _thinned(time: Any, values: Any) -> dict[str, list[float]]:
    step = max(1, -(-len(time) // _MOST_POINTS))
    return {
        "time_s": np.round(time[::step], 1).tolist(),
        "value": np.round(values[::step], 3).tolist(),
    }
