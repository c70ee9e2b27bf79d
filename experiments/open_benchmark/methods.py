"""Methods of the drift track that fogml does not ship, as anyone would hand in theirs."""

from __future__ import annotations

from pathlib import Path

from experiments.thermal_cycle.recurrent import Recurrent
from fogml.benchmark.answers import answer_by
from fogml.blind.folders import CaseFiles


def gru(case: CaseFiles, out: Path) -> None:
    """A GRU of four units over T and its rate, 404 bytes."""
    answer_by(Recurrent(), case, out)
