"""The result of planning: runs, what they are expected to tell, and runners-up."""

from __future__ import annotations

from dataclasses import dataclass

from fogml.gap.planning.fisher import Criterion
from fogml.gap.planning.rehearsal import Rehearsal
from fogml.gap.planning.separating import LEAST_DISTANCE
from fogml.gap.result_parts import Rehearsed
from fogml.runs.facts import Facts
from fogml.runs.run import FloatArray
from fogml.signals.noise_model import NoiseModel
from fogml.twin.programme import Programme

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
        Expected standard error; None where the runs don't show it.
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
    """How far apart a plan pulls effects: least distance, and of each (row) from each other (column)."""

    members: tuple[str, ...]
    distance: float
    pairs: FloatArray

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
    runs: tuple[PlannedRun, ...]
    assumed: tuple[str, ...]
    rehearsal: tuple[Rehearsed, ...] = ()

    @property
    def outlook(self) -> Outlook:
        """What is expected of all runs together."""
        return self.runs[-1].outlook
