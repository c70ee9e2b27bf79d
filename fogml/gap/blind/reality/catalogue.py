"""All forms of this reality, by name."""

from __future__ import annotations

from fogml.gap.blind.reality.effects import (
    coil,
    electrical,
    invented,
    invented_rig,
    memory,
    sensing,
    turning,
)
from fogml.gap.blind.reality.form import Form

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


def known_names() -> tuple[str, ...]:
    """Ids of the catalogue's effects that have a form here, in order."""
    return tuple(dict.fromkeys(form.name for form in KNOWN))


def forms_of(name: str) -> tuple[type[Form], ...]:
    """Forms of one effect."""
    return tuple(form for form in KNOWN if form.name == name)
