"""All forms of this reality, by name."""

from __future__ import annotations

from fogml.blind.first.effects import (
    coil,
    electrical,
    invented,
    invented_rig,
    memory,
    sensing,
    turning,
)
from fogml.blind.first.unit import draw_unit
from fogml.blind.frame.form import Form
from fogml.blind.frame.reality import Reality

KNOWN: tuple[type[Form], ...] = (
    *coil.FORMS,
    *memory.FORMS,
    *electrical.FORMS,
    *turning.FORMS,
    *sensing.FORMS,
)
"""Forms of effects that the catalogue holds; some effects have two.

``mount_tilt`` has none: with Earth rate alone on a table that turns, a tilt that a fixture has stays
far under the noise of every unit here.
"""
INVENTED: tuple[type[Form], ...] = (*invented.FORMS, *invented_rig.FORMS)
"""Effects that no library holds."""
WRONG_STRUCTURE: type[Form] = memory.DeepPlate
"""Another thermal order than any twin's."""


REALITY = Reality("first", KNOWN, INVENTED, WRONG_STRUCTURE, draw_unit)
