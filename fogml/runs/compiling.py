"""When to load the compiler: as soon as compiled code would have saved what loading takes."""

from __future__ import annotations

import sys

LOADING_S = 0.35
"""What loading numba and a kept kernel takes [s]."""
_missed_s = 0.0


def pays_by_now(saving_s: float) -> bool:
    """Whether numba is loaded, or would have paid for it in this process with what is to be done now.

    Waiting for that costs at most as much again as loading at once would have; a command that reads
    one short run never loads it.

    Parameters
    ----------
    saving_s
        What compiled code saves now [s].
    """
    global _missed_s
    if "numba" in sys.modules:
        return True
    _missed_s += saving_s
    return _missed_s >= LOADING_S
