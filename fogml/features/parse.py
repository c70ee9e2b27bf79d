"""From feature text to features."""

from __future__ import annotations

from fogml.features.features import Features


def parse_features(text: str) -> Features:
    """The features that a text stands for, e.g. ``"T^1..5, dT[slope, 60 s], T*dT"``.

    The grammar is in `fogml.features.grammar`.

    Raises
    ------
    InputError
        If the text is not understood; the message points at the place and lists what is known.
    """
    return Features(text)
