"""What a run's output would be with effects of other sizes: courses that add up."""

from __future__ import annotations

from dataclasses import dataclass

from fogml.runs.run import FloatArray


@dataclass(frozen=True, eq=False)
class Course:
    """What one effect makes of a run at a size.

    Attributes
    ----------
    effect
        Its id.
    size, unit
        The amplitude that ``values`` are of, in the card's unit.
    acts
        Whether it is part of what is replayed: named, or on in the twin.
    signed
        Whether it may be of either sign.
    values
        [deg/h], shape (k,).
    """

    effect: str
    size: float
    unit: str
    acts: bool
    signed: bool
    values: FloatArray


@dataclass(frozen=True, eq=False)
class Counterfactual:
    """A run as averages of shape (k,): recorded, replayed without any effect, and what each effect adds.

    Effects are linear in their size, so that ``replayed + sum of factor * course`` is exact at any factors;
    those that are not, as a deadband, are left out.
    """

    run: str
    held_out: bool
    averaging_s: float
    time_s: FloatArray
    temperature_degc: FloatArray
    recorded: FloatArray
    replayed: FloatArray
    floor: float
    courses: tuple[Course, ...]
