"""The result of a diagnosis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from fogml.gap.model import AnyModel, EffectValue, NoisePrior, TwinModel
from fogml.gap.result_json import gap_values
from fogml.gap.result_parts import (
    CauseShare,
    Compensation,
    ConstantFit,
    HowFar,
    Nearest,
    Rehearsed,
    RunSeries,
    WhatIf,
    Where,
)
from fogml.gap.step_settings import Reported
from fogml.pictures import Panel, Pictured
from fogml.runs.run import Run
from fogml.twin.uncertainty import Uncertainty

NAMED = 0.5
"""An effect is named from this probability on."""
Verdict = Literal["no_gap", "explained", "ambiguous", "partly_explained", "unknown"]


@dataclass(frozen=True)
class Estimate:
    """A number with its standard error and unit."""

    value: float
    se: float
    unit: str


@dataclass(frozen=True)
class RunAmplitude:
    """An effect's amplitude from one run alone, its form as found, all else anew."""

    run: str
    value: float
    se: float


@dataclass(frozen=True)
class Onset:
    """Since when an effect acts: run, time on its clock [s], what that explains more [nats], size since."""

    run: str
    time_s: float
    gain: float
    amplitude: Estimate


@dataclass(frozen=True)
class Found:
    """An effect that was found.

    Attributes
    ----------
    effect, stage
        Id and stage.
    members
        Ids that these runs can't tell from it, itself included.
    probability
        That one of the members acts.
    prior_probability
        The same before the data: the more causes these runs can tell, the less likely each of them.
    amplitude
        In the card's unit; its standard error holds what the true form may differ by.
    parameters
        Shape parameters by name.
    left_out
        Ids of effects that are no candidates, and that look like it.
    by_run
        The amplitude from each run that can show it.
    consistent
        Whether those since it acts agree in sign and size.
    grows
        Change of its size a day, in its unit; None where the runs tell of none.
    onset
        Since when it acts; None where from the first run on.
    log_odds
        By the evidence: of a known cause in its place against something unknown; of its class among those;
        and the logarithm of its share of what all causes make, by energy.
    share
        Of the structural gap's energy above the floor, between 0 and 1.
    place
        Where it sits: the place to look.
    times_usual
        The amplitude over the top of its card's range.
    """

    effect: str
    stage: str
    members: tuple[str, ...]
    probability: float
    prior_probability: float
    amplitude: Estimate
    parameters: Mapping[str, Estimate] = field(default_factory=dict)
    by_run: tuple[RunAmplitude, ...] = ()
    consistent: bool = True
    share: float | None = None
    place: str = ""
    times_usual: float | None = None
    left_out: tuple[str, ...] = ()
    grows: float | None = None
    onset: Onset | None = None
    log_odds: tuple[float, float, float] | None = None

    @property
    def named(self) -> bool:
        """Whether it is named."""
        return self.probability >= NAMED

    @property
    def others(self) -> tuple[str, ...]:
        """Members of its class beside itself."""
        return tuple(m for m in self.members if m != self.effect)


@dataclass(frozen=True)
class Unknown:
    """What no candidate explains: its probability, and what it looks like in plain words."""

    probability: float
    looks_like: str


def in_doubt(verdict: Verdict, found: Sequence[Found], unknown: Unknown) -> Found | None:
    """The likeliest cause where nothing is named, and something acts more likely than not."""
    likeliest = max(found, key=lambda f: f.probability, default=None)
    if likeliest is None or verdict != "no_gap":
        return None
    return likeliest if likeliest.probability + unknown.probability >= NAMED else None


@dataclass(frozen=True)
class SeparatingRun:
    """The programme that tells a class's members apart, or shows what runs so far could not.

    `distance` is the least between two of the effects, or the least of their whitened lengths.
    """

    separates: tuple[str, ...]
    programme: str
    distance: float
    hours: float
    steps: tuple[str, ...] = ()
    alternatives: tuple[Mapping[str, Any], ...] = ()
    aim: Literal["tell_apart", "show"] = "tell_apart"


@dataclass(frozen=True)
class NoiseReport:
    """The noise model.

    ``coefficients`` and ``relative_se`` by the names N, B, K. ``source`` says what it was fitted
    on; ``white`` and ``failed`` are the check on the held-out runs' innovations. ``lags_s`` and ``scales_s``
    count rows, each of the mean length of the held-out runs' [s].
    """

    coefficients: Mapping[str, float]
    relative_se: Mapping[str, float]
    source: str
    white: bool | None = None
    p_value: float | None = None
    failed: tuple[str, ...] = ()
    lags_s: tuple[float, ...] = ()
    autocorrelation: tuple[float, ...] = ()
    scales_s: tuple[float, ...] = ()
    variance_ratio: tuple[float, ...] = ()
    samples: int = 0


@dataclass(frozen=True)
class CandidateEvidence:
    """How a candidate alone does: gain in log evidence over no effect [nats], and what the runs can show."""

    effect: str
    title: str
    stage: str
    gain: float
    probability: float
    usual_length: float
    status: Literal["named", "possible", "no_sign", "undetectable", "in_constants"]


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Pictured):
    """The result of `fogml.gap.diagnose`.

    Attributes
    ----------
    fit, held_out, noise_run
        Names of the runs.
    held_out_is_part
        Whether the last stretch of the last run was held out for want of a run.
    verdict
        In one word.
    found
        Effects with some probability, the most certain first.
    suspected
        Effects of an unknown gap that are not sure enough to be named.
    unknown
        What no candidate explains.
    where, how_far
        Of the structural gap, and what is closed on each held-out run.
    undetectable
        Candidates that these runs could not show at their usual size.
    separating_run
        What to measure next; None where nothing is open.
    constants
        The recalibrated constants.
    evidence
        Each candidate by itself.
    noise
        The noise model.
    effects
        The named effects as fitted, to be added to the model.
    series
        For drawing.
    unusable
        Runs that could not be used, with the reason.
    assumed
        What was assumed, in words.
    model
        Name of the model.
    what_if
        For every candidate what the held-out runs keep with it.
    nearest
        The known families that come nearest to the gap, each alone.
    headline
        Sentences that say the result.
    rehearsal
        What these runs would name of each candidate, where that was asked for.
    shares
        Of the gap's energy: of each cause in all, by run and by regime.
    compensation
        What of it a gyro can compensate by itself.
    uncertainty
        Covariance of constants and named effects together.
    least_suspected
        A cause that is not named is kept in a twin as suspected from this probability on.
    """

    fit: tuple[str, ...]
    held_out: tuple[str, ...]
    noise_run: str | None
    held_out_is_part: bool
    verdict: Verdict
    found: tuple[Found, ...]
    unknown: Unknown
    where: Where
    how_far: tuple[HowFar, ...]
    undetectable: tuple[str, ...]
    separating_run: SeparatingRun | None
    constants: tuple[ConstantFit, ...]
    evidence: tuple[CandidateEvidence, ...]
    noise: NoiseReport
    effects: tuple[EffectValue, ...]
    series: tuple[RunSeries, ...]
    unusable: tuple[tuple[str, str], ...] = ()
    assumed: tuple[str, ...] = ()
    model: str = "nominal"
    suspected: tuple[Found, ...] = ()
    what_if: tuple[WhatIf, ...] = ()
    nearest: tuple[Nearest, ...] = ()
    headline: tuple[str, ...] = ()
    rehearsal: tuple[Rehearsed, ...] = ()
    shares: tuple[CauseShare, ...] = ()
    compensation: Compensation | None = None
    uncertainty: Uncertainty | None = None
    least_suspected: float = Reported.suspected

    @property
    def named(self) -> tuple[Found, ...]:
        """The effects that are named."""
        return tuple(found for found in self.found if found.named)

    @property
    def counterfactuals(self) -> tuple[RunSeries, ...]:
        """Runs with what each effect makes of them, where that was asked for."""
        return tuple(one for one in self.series if one.courses)

    def write_model(self, model: AnyModel, path: Path, runs: Sequence[Run] = ()) -> tuple[str, ...]:
        """Write the diagnosed model, constants fitted and effects added, as ``twin.yaml``.

        A twin has its covariance, what is suspected, and a plant fitted to `runs` besides, told in sentences.
        """
        from fogml.gap.fitted_model import better_twin
        from fogml.twin.twin_file import save_twin

        noise, spread = self.noise.coefficients, self.noise.relative_se
        factors = {f"factor_{name}": max(math.exp(spread.get(name, 0.0)), 1.0) for name in "NBK"}
        values = (
            {c.name: c.value for c in self.constants},
            self.effects,
            NoisePrior(noise["N"], noise["B"], noise["K"], **factors),
            {c.name: c.se for c in self.constants},
        )
        if not isinstance(model, TwinModel):
            model.write(path, *values)
            return ()
        twin, told = better_twin(model.diagnosed(*values), self, runs)
        save_twin(twin, path)
        return told

    def as_dict(self) -> dict[str, Any]:
        """The content of ``gap.json``."""
        return gap_values(self)

    def _heading(self) -> Sequence[str]:
        return self.headline or (self.verdict,)

    def _panels(self) -> Sequence[Panel]:
        return [one.panel() for one in self.series]
