"""Doubt for what was left out: a named effect that one which is no candidate looks like."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from fogml.gap.result import Found, Unknown


def doubted(unknown: Unknown, found: Sequence[Found]) -> Unknown:
    """The unknown, at least as probable as that a left-out look-alike acts in the place of a named effect.

    All look-alikes count as likely as each member of the class: these runs can't say which it is.
    """
    shares = [f.probability * len(f.left_out) / len({*f.members, *f.left_out}) for f in found if f.left_out]
    if not shares:
        return unknown
    doubt = 1.0 - math.prod(1.0 - share for share in shares)
    names = ", ".join(dict.fromkeys(id for f in found for id in f.left_out))
    words = f"may be {names}, left out of the candidates, in place of what is named"
    if unknown.probability > doubt and unknown.looks_like:
        words = f"{unknown.looks_like}; {words}"
    return replace(unknown, probability=1.0 - (1.0 - unknown.probability) * (1.0 - doubt), looks_like=words)
