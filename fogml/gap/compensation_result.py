"""What of a diagnosis a gyro can compensate by itself: causes as features, and what they bring."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Compensable:
    """A candidate as features of a drift model.

    Attributes
    ----------
    effect
        Its id.
    counted
        Whether a model made of the diagnosis takes it: it is named, or the twin has it already.
    features
        Text of each feature; none where a unit can't compensate it by itself.
    reason
        Why not.
    """

    effect: str
    counted: bool
    features: tuple[str, ...]
    reason: str = ""


@dataclass(frozen=True)
class Brought:
    """What a drift model brings on a held-out run: rms of averages over `averaging_s` [deg/h].

    Attributes
    ----------
    before
        Of the output less the training runs' mean, or less Earth rate where that is known.
    constants
        Compensated with the twin's constants alone.
    after
        With the causes that count as well; where none does, as `constants`.
    floor
        Of the noise.
    """

    run: str
    averaging_s: float
    before: float
    constants: float
    after: float
    floor: float
    unit: str = "deg/h"


@dataclass(frozen=True)
class Compensation:
    """The twin's constants and every candidate as features, and what those that count bring.

    ``held_out`` is empty until a drift model was fitted; ``note`` says why none could be.
    """

    constants: tuple[str, ...]
    causes: tuple[Compensable, ...]
    held_out: tuple[Brought, ...] = ()
    note: str = ""

    @property
    def counted(self) -> tuple[Compensable, ...]:
        """Causes that a model takes: they count, and have features."""
        return tuple(c for c in self.causes if c.counted and c.features)
