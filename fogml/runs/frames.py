"""Frames of text with sums, as NMEA 0183 has them: ``$PGYRO,1,9.6*5B``."""

from __future__ import annotations

import re

import numpy as np

_FRAME = re.compile(rb"\$([^$*\n]*)\*([0-9A-Fa-f]{2})[ \t\r]*\Z")


def is_frame(line: str) -> bool:
    """Whether a line ends as a frame of NMEA 0183 does: a ``$``, what is told, a ``*`` and its sum."""
    return "$" in line and frames_checked(line.encode()) != b"*"


def frames_checked(content: bytes) -> bytes:
    """Lines with a ``$`` without the sum at their end; those whose sum is wrong or lost as ``*`` alone.

    It is the exclusive or of all bytes between ``$`` and ``*`` (NMEA 0183).
    """
    sums = np.bitwise_xor.accumulate(np.frombuffer(content, dtype=np.uint8))

    def checked(line: re.Match[bytes]) -> bytes:
        found = _FRAME.search(line[0])
        if found is None:
            return b"*"
        before, last = (line.start() + place - 1 for place in found.span(1))
        return line[0][: found.end(1)] if sums[before] ^ sums[last] == int(found[2], 16) else b"*"

    return re.sub(rb"(?m)^.*\$.*$", checked, content)
