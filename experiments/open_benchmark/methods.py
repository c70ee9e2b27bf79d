"""Methods of the drift track that fogml does not ship, as anyone would hand in theirs."""

from __future__ import annotations

from pathlib import Path

from experiments.benchmarks.peer_model import Budget, PeerModel
from experiments.benchmarks.peers import peer_of
from experiments.thermal_cycle.small_models import SmallModel
from fogml.benchmark.answers import answer_by
from fogml.blind.folders import CaseFiles


def gaussian_process(case: CaseFiles, out: Path) -> None:
    """scikit-learn's, on at most 300 averages of T, its rate and their product, tuned by its evidence."""
    answer_by(PeerModel(peer_of("gaussian-process"), Budget(most_rows=300), case.seed), case, out)


def gru(case: CaseFiles, out: Path) -> None:
    """A GRU of four units over T and its rate, 404 bytes."""
    answer_by(SmallModel("GRU"), case, out)


def px4_cubic(case: CaseFiles, out: Path) -> None:
    """PX4's cubic: of a warm-up to new heights by 24 degC at least, held beyond its range."""
    answer_by(SmallModel("PX4's cubic"), case, out)
