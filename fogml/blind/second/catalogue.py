"""All forms of this reality."""

from __future__ import annotations

from fogml.blind.frame.form import Form
from fogml.blind.frame.reality import Reality
from fogml.blind.second.effects import (
    driven,
    lasting,
    sensing,
    turning,
    unknown,
    unknown_sensing,
    winding,
)
from fogml.blind.second.unit import draw_unit

KNOWN: tuple[type[Form], ...] = (
    *winding.FORMS,
    *lasting.FORMS,
    *driven.FORMS,
    *turning.FORMS,
    *sensing.FORMS,
)
"""Forms of effects that a gyro's physics knows by name; how near the catalogue's are is not asked.

``mount_tilt`` and ``coil_expansion`` have none: with Earth rate alone on a table that turns, and with sensors
on the coil, no run of a unit here shows them.
"""
INVENTED: tuple[type[Form], ...] = (*unknown.FORMS, *unknown_sensing.FORMS)
"""Effects that no library holds."""
REALITY = Reality("second", KNOWN, INVENTED, lasting.AnotherOrder, draw_unit)
