"""What a method answered to a case, read from ``gap.json`` and ``outcome.json``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fogml.blind.folders import OUTCOME, read_json
from fogml.blind.truth import Amount
from fogml.errors import InputError
from fogml.strict import Strict, strictly

NAMED = 0.5
"""Probability from which an effect counts as named."""


class _Answered(BaseModel):
    # Further keys are welcome in gap.json.
    model_config = ConfigDict(
        extra="ignore", frozen=True, allow_inf_nan=False, protected_namespaces=(), populate_by_name=True
    )


class Fitted(Amount):
    """A fitted value with its standard error."""

    model_config = ConfigDict(extra="ignore", frozen=True)
    se: float | None = None


class Listed(_Answered):
    """An item of ``which``."""

    effect: str
    members: tuple[str, ...] = Field(alias="class")
    probability: float = Field(ge=0.0, le=1.0)
    amplitude: Fitted | None = None

    @property
    def named(self) -> bool:
        """Whether it is certain enough to count."""
        return self.probability >= NAMED


class _Unknown(_Answered):
    probability: float = Field(ge=0.0, le=1.0)


class _Stretch(_Answered):
    run: str
    from_s: float
    to_s: float


class _Where(_Answered):
    segments: tuple[_Stretch, ...] | None = None


class HowFar(_Answered):
    """An item of ``how_far``."""

    run: str
    averaging_s: float
    recalibrated: float | None = None
    after: float | None = None
    floor: float | None = None
    closed: float | None = None
    closed_ci90: tuple[float | None, float | None] | None = None


class Gap(_Answered):
    """The keys of ``gap.json`` that are scored."""

    verdict: str
    which: tuple[Listed, ...] = ()
    suspected: tuple[Listed, ...] = ()
    unknown: _Unknown = _Unknown(probability=0.0)
    where: _Where = _Where()
    how_far: tuple[HowFar, ...] = ()


@dataclass(frozen=True)
class Answer:
    """One answer.

    Attributes
    ----------
    gap
        What was answered; None where the case failed.
    failure
        Why it failed; empty where it did not.
    seconds, samples
        Time taken [s] and samples read, where they were recorded.
    code
        State of the code that answered, where it was recorded.
    """

    gap: Gap | None
    failure: str = ""
    seconds: float | None = None
    samples: int | None = None
    code: str | None = None


class _Outcome(Strict):
    """The keys of ``outcome.json`` that are scored, as `fogml.blind.run` writes them."""

    model_config = ConfigDict(extra="ignore")
    done: bool
    reason: str | None = None
    message: str = ""
    seconds: float | None = Field(default=None, ge=0.0)
    samples: int | None = Field(default=None, ge=0)
    code: str | None = None


def read_answer(folder: Path) -> Answer:
    """The answer in a folder; one that is missing or breaks the schema is a failure."""
    outcome = _Outcome(done=True)

    def failed(reason: str) -> Answer:
        return Answer(None, reason, outcome.seconds, code=outcome.code)

    try:
        if (folder / OUTCOME).is_file():
            outcome = strictly(_Outcome, read_json(folder / OUTCOME), OUTCOME)
        if not outcome.done:
            return failed(f"{outcome.reason}: {outcome.message}")
        gap = Gap.model_validate(read_json(folder / "gap.json"))
    except InputError as error:
        return Answer(None, f"no answer: {error}")
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        return failed(f"gap.json, key '{key}': {first['msg']}")
    return Answer(gap, "", outcome.seconds, outcome.samples, outcome.code)
