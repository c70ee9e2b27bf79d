"""What the cases of a round are drawn from: one settings object, which ``round.json`` states."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from fogml.blind.truth import Kind
from fogml.signals.averages import AVERAGING_S


@dataclass(frozen=True)
class RoundDesign:
    """What a round's cases are drawn from and how drift is averaged; its ``round.json`` states it.

    Attributes
    ----------
    sample_s
        Of synthetic runs [s]: as in the suites of ``fogml blind``.
    drift_kinds, drift_d_prime
        Causes of drift that a synthetic unit of the drift track has, and the range of their whitened lengths:
        plain to see in a run, and below what would drown all else.
    least_d_prime
        Whitened length beside the constants that a cause of the diagnosis track has at least: what a
        detection of one false in a thousand sees nearly always.
    averaging_s
        Of figures of synthetic runs [s]: short beside a coil's thermal time, long beside white noise.
    cycle_pairs
        Legs of the thermal cycle to train on, and the one to test on.
    cycle_averaging_rows
        Samples in an average of its figures.
    cold_pairs
        Thirds of the cold start to train on, counted from 0, and the one to test on.
    cold_sample_s, cold_averaging_s
        It is handed out as averages over so long [s], as its 59 Hz say nothing more of its drift, and its
        figures are averages over so long [s]: a third lasts minutes.
    settling_s
        Start of a held-out run that enters no figure, as windows fill there [s].
    """

    sample_s: float = 10.0
    drift_kinds: tuple[Kind, ...] = ("one", "two", "three", "unknown_invented")
    drift_d_prime: tuple[float, float] = (20.0, 60.0)
    least_d_prime: float = 10.0
    averaging_s: float = AVERAGING_S
    cycle_pairs: tuple[tuple[str, str], ...] = (("12", "3"), ("13", "2"), ("23", "1"), ("1", "2"), ("2", "3"))
    cycle_averaging_rows: int = 20
    cold_pairs: tuple[tuple[tuple[int, ...], int], ...] = (((0, 1), 2), ((1, 2), 0))
    cold_sample_s: float = 0.3
    cold_averaging_s: float = 20.0
    settling_s: float = 128.0

    def stated(self) -> dict[str, Any]:
        """As ``round.json`` states it."""
        return {key: list(v) if isinstance(v, tuple) else v for key, v in asdict(self).items()}


DESIGN = RoundDesign()
"""Of rounds that are made unless another is asked for."""
