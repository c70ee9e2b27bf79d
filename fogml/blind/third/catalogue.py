"""All forms of this reality."""

from __future__ import annotations

from fogml.blind.frame.form import Form
from fogml.blind.frame.reality import Reality
from fogml.blind.third.effects import driven, unknown, winding
from fogml.blind.third.unit import draw_unit

KNOWN: tuple[type[Form], ...] = (*winding.FORMS, *driven.FORMS)
"""Forms of effects that a gyro's physics knows by name; those of supply, field and rig stand elsewhere."""
INVENTED: tuple[type[Form], ...] = unknown.FORMS
"""Effects that no library holds."""
REALITY = Reality("third", KNOWN, INVENTED, winding.OtherInside, draw_unit)
