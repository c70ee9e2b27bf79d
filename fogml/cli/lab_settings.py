"""What a lab can do for planned programmes, as options of ``plan`` and of other commands' ``--lab``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fogml.cli.settings import setting
from fogml.errors import InputError, known_are
from fogml.strict import Strict, strictly

if TYPE_CHECKING:
    from fogml.gap.planning.programme_family import Family


class LabSettings(Strict):
    """Limits of chamber, table, power supply and time."""

    hours: float = setting(24.0, "Longest time of a run.", metavar="HOURS")
    coldest: float = setting(-40.0, "Lowest temperature.", metavar="DEGC")
    hottest: float = setting(60.0, "Highest temperature.", metavar="DEGC")
    fastest_ramp: float = setting(2.0, "Fastest ramp of the chamber.", metavar="DEGC/MIN")
    fastest_turn: float = setting(100.0, "Fastest rate of the table; 0: there is none.", metavar="DEG/S")
    power_steps: bool = setting(
        True, "Whether the unit's power may be switched.", "--power-steps/--no-power-steps"
    )
    fan_steps: bool = setting(
        True, "Whether the chamber's fan may be switched.", "--fan-steps/--no-fan-steps"
    )
    compressor_steps: bool = setting(
        True, "Whether its compressor may be switched.", "--compressor-steps/--no-compressor-steps"
    )
    yaw: bool = setting(True, "Whether the fixture can be turned to other headings.", "--yaw/--no-yaw")

    def family(self) -> Family:
        """The programmes within the limits."""
        from fogml.gap.planning.lab import Lab
        from fogml.gap.planning.programme_family import Family

        lab = Lab(self.fastest_ramp, self.fastest_turn, self.fan_steps, self.compressor_steps, self.yaw)
        limits = (self.coldest, self.hottest)
        return Family(self.hours, limits, power_steps=self.power_steps, lab=lab)


def family_of(values: Mapping[str, Any]) -> Family:
    """The programmes within limits that ``--lab`` states.

    Raises
    ------
    InputError
        Naming what is unknown or can't be.
    """
    for name in values:
        if name not in LabSettings.model_fields:
            raise InputError(f"--lab {name}: {known_are(str(name), LabSettings.model_fields, 'limits')}")
    try:
        return strictly(LabSettings, dict(values)).family()
    except InputError as error:
        raise InputError(f"--lab: {error}") from None
