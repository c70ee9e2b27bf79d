"""``fogml plan``: programmes that make wanted parameters identifiable."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, Field

from fogml.cli import options
from fogml.cli.given import option
from fogml.cli.settings import Settings


def _groups(value: Any) -> Any:
    """``["a,b", ...]`` as flags give them, or lists as YAML does."""
    return [options.names_list(group) for group in value] if isinstance(value, list) else value


def _capital(value: Any) -> Any:
    return value.upper() if isinstance(value, str) else value


def _usual_latitude() -> float:
    from fogml.twin.simulate import DEFAULT_FACTS

    return DEFAULT_FACTS.latitude or 0.0


class PlanSettings(Settings):
    """Programmes that make wanted parameters identifiable, with expected standard errors.

    Searches rates, limits, soaks, a minor loop, table rates, power steps, fan and yaw. Writes
    programme.yaml for fogml simulate, plan.json, plan.html and plan.config.yaml.
    """

    job: ClassVar[str] = "fogml.cli.plan_job:plan_and_write"
    want: Annotated[
        list[str],
        option(
            "Effect, nominal constant (k1), or EFFECT.PARAMETER to be known; may be repeated.",
            metavar="EFFECT|CONSTANT",
            known=options.EFFECTS,
        ),
    ] = []
    separate: Annotated[
        list[list[str]],
        BeforeValidator(_groups),
        option(
            "Effects to be told apart; one alone is to be shown; repeatable.",
            metavar="A,B",
            known=options.EFFECTS,
        ),
    ] = []
    hours: Annotated[float, option("Longest time of a run.", metavar="HOURS")] = 24.0
    criterion: Annotated[
        str,
        BeforeValidator(_capital),
        option(
            "D: volume of the confidence ellipsoid; A: mean square of the standard errors.",
            metavar="D|A",
            known=("D", "A"),
        ),
    ] = "D"
    runs: Annotated[int, option("How many runs, planned in turn.")] = 1
    twin: options.Twin = "nominal"
    coldest: Annotated[float, option("Lowest temperature.", metavar="DEGC")] = -40.0
    hottest: Annotated[float, option("Highest temperature.", metavar="DEGC")] = 60.0
    input_axis: Annotated[
        str | None, option("up, down, north ...: the mounting; up or north is tried else.", metavar="WAY")
    ] = None
    latitude: Annotated[float, option("Of the lab (39.9).", metavar="DEG")] = Field(
        default_factory=_usual_latitude
    )
    power_steps: Annotated[
        bool, option("Whether the unit's power may be switched.", "--power-steps/--no-power-steps")
    ] = True
    out: options.Folder = "plan"
