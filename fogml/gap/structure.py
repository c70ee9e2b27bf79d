"""The structural gap of each run: what recalibration leaves, and the systematic part of it.

The systematic part is what the evidence takes what acts for, named or not: a gap has its place though
its cause may not be known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from fogml.gap.frame import constant_rows
from fogml.gap.model import Candidate
from fogml.gap.observation import Observation
from fogml.gap.search import Search
from fogml.gap.where import GapOnRun
from fogml.runs.run import FloatArray

if TYPE_CHECKING:
    from fogml.gap.classes import Ranking
    from fogml.gap.preparing import Prepared

GROUP_STAGE = {"table_rate": "scale_factor"}
"""Stage that a group of the unknown is booked on; bias for the others."""


def gaps_on_runs(p: Prepared, parts: Mapping[str, Sequence[FloatArray]]) -> list[GapOnRun]:
    """The structural gap of the fit runs, with its systematic part: the sum of `systematic_parts`."""
    gaps = []
    for r, o in enumerate(p.fit):
        recalibrated = o.averaged(o.model.output(p.recalibrated.constants, p.recalibrated.effects))
        systematic = sum((runs[r] for runs in parts.values()), np.zeros(len(o)))
        gaps.append(GapOnRun(o, o.recorded - recalibrated, systematic, _taken(p, o)))
    return gaps


def _taken(p: Prepared, o: Observation) -> float:
    """Mean square of what the noise moves the recalibrated constants by, on a run [(deg/h)^2]."""
    count = len(p.model.constants)
    rows = constant_rows(o, p.model.constants) / [c.sd for c in p.model.constants]
    return float(np.mean(np.sum((rows @ p.recalibrated.covariance[:count, :count]) * rows, axis=1)))


def stage_energies(
    candidates: Mapping[str, Candidate], parts: Mapping[str, Sequence[FloatArray]]
) -> dict[str, float]:
    """Energy of `systematic_parts` by stage [(deg/h)^2], summed over the rows of all runs."""
    energies: dict[str, float] = {}
    for id, runs in parts.items():
        stage = candidates[id].stage if id in candidates else GROUP_STAGE.get(id, "bias")
        energy = float(sum(np.sum(values**2) for values in runs))
        if energy > 0.0:
            energies[stage] = energies.get(stage, 0.0) + energy
    return energies


def systematic_parts(search: Search, ranking: Ranking) -> dict[str, list[FloatArray]]:
    """What each part of the best explanation makes on each run beside the constants [deg/h], shape (m,).

    By ids of effects, and the name of the group of what acts besides; all as much smaller as it is
    probable that nothing acts.
    """
    frame = search.field_.basis.frame
    parts = {}
    for name, rows in search.estimates(ranking.best).items():
        white = (1.0 - ranking.nothing) * frame.without_constants(rows)
        parts[name] = [whitener.colour(white[part]) for part, whitener in zip(frame.runs, frame.whiteners)]
    return parts
