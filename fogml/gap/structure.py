"""The structural gap of each run: what recalibration leaves, and the systematic part of it.

The systematic part is what the evidence takes what acts for, named or not: a gap has its place though
its cause may not be known.
"""

from __future__ import annotations

from collections.abc import Mapping
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


def gaps_on_runs(p: Prepared, search: Search, ranking: Ranking) -> list[GapOnRun]:
    """The structural gap of the fit runs, with its systematic part."""
    frame = search.field_.basis.frame
    white = sum(systematic_parts(search, ranking).values(), np.zeros(frame.runs[-1].stop))
    gaps = []
    for o, part, whitener in zip(p.fit, frame.runs, frame.whiteners):
        recalibrated = o.averaged(o.model.output(p.recalibrated.constants, p.recalibrated.effects))
        gaps.append(GapOnRun(o, o.recorded - recalibrated, whitener.colour(white[part]), _taken(p, o)))
    return gaps


def _taken(p: Prepared, o: Observation) -> float:
    """Mean square of what the noise moves the recalibrated constants by, on a run [(deg/h)^2]."""
    count = len(p.model.constants)
    rows = constant_rows(o, p.model.constants) / [c.sd for c in p.model.constants]
    return float(np.mean(np.sum((rows @ p.recalibrated.covariance[:count, :count]) * rows, axis=1)))


def stage_energies(candidates: Mapping[str, Candidate], search: Search, ranking: Ranking) -> dict[str, float]:
    """Energy of the systematic part by stage [(deg/h)^2], summed over the rows of all runs."""
    frame = search.field_.basis.frame
    energies: dict[str, float] = {}
    for id, white in systematic_parts(search, ranking).items():
        stage = candidates[id].stage if id in candidates else GROUP_STAGE.get(id, "bias")
        values = [whitener.colour(white[part]) for part, whitener in zip(frame.runs, frame.whiteners)]
        energy = float(sum(np.sum(v**2) for v in values))
        if energy > 0.0:
            energies[stage] = energies.get(stage, 0.0) + energy
    return energies


def systematic_parts(search: Search, ranking: Ranking) -> dict[str, FloatArray]:
    """What each part of the best explanation makes beside the constants, whitened, shape (n,).

    By ids of effects, and the name of the group of what acts besides; all as much smaller as it is
    probable that nothing acts.
    """
    frame = search.field_.basis.frame
    return {
        name: (1.0 - ranking.nothing) * frame.without_constants(rows)
        for name, rows in search.estimates(ranking.best).items()
    }
