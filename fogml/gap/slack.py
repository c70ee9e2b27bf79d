"""What an effect's true form may differ from the catalogue's by.

No gyro follows a catalogue's equation to the last per cent. Without room for that, the rest of a
large effect would be given another effect's name. The room is made of the response times powers of
temperature and time, of the response later or earlier, with other thermal orders, and of the
candidate's other shapes, of a line those of nearly its frequency.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fogml.gap.frame import main_axes
from fogml.gap.model import OtherOrders
from fogml.gap.observation import Observation
from fogml.runs.run import FloatArray
from fogml.twin.memory import Memory

if TYPE_CHECKING:
    from fogml.gap.basis import Basis
    from fogml.gap.candidate_columns import NodeColumns

LAGS_S = (60.0, 300.0, 1200.0)
EARLY_S = 30.0
"""A response that smoothed readings make late may truly be earlier by so much [s]."""
MOST_COLUMNS = 8
MOST_DRAWS = 4
NEAR_CYCLES = 2.0
"""Lines further apart, in cycles over the longest run, are other lines, not another form of one."""


def slack_columns(basis: Basis, node: int) -> FloatArray:
    """Whitened columns, shape (n, k), beside the node's own, a length of 1 in all beside the constants."""
    chosen = basis.nodes[node]
    frame = basis.frame
    draws = chosen.node.draws[:: -(-len(chosen.node.draws) // MOST_DRAWS)]
    parts = []
    for o in frame.observations:
        responses = [o.response(chosen.candidate, shape, frame.values) for shape in draws]
        varied = [column for r in responses for column in _varied(o, r)]
        parts.append([*varied, *_other_orders(o, chosen.candidate, draws[0], frame.values, responses[0])])
    most = max(map(len, parts))
    # A run that recorded every node has no other orders.
    stacked = [
        np.column_stack([*part, *[np.zeros(len(o))] * (most - len(part))])
        for o, part in zip(frame.observations, parts)
    ]
    others = [
        n.columns
        for n in basis.nodes
        if n.candidate == chosen.candidate and n is not chosen and _near(n, chosen, frame.spans["s"])
    ]
    neighbours = basis.rows[:, [c for columns in others for c in columns]]
    columns = np.concatenate([frame.white(stacked), neighbours], axis=1)
    columns = basis.beside_own(chosen, columns)
    axes = main_axes(frame.beside(columns), 1e-2)[:, :MOST_COLUMNS]
    return np.asarray(columns @ axes)


def _near(other: NodeColumns, node: NodeColumns, span_s: float) -> bool:
    a, b = other.node.frequency_hz, node.node.frequency_hz
    return a is None or b is None or abs(a - b) * span_s <= NEAR_CYCLES


def _other_orders(
    o: Observation, id: str, shape: Mapping[str, float], values: Mapping[str, float], response: FloatArray
) -> list[FloatArray]:
    if not isinstance(o.model, OtherOrders):
        return []
    return [o.averaged(other) - response for other in o.model.other_orders(id, shape, values)]


def _varied(o: Observation, response: FloatArray) -> list[FloatArray]:
    t = o.temperature
    half = max(0.5 * float(np.ptp(t)), 1.0)
    u = (t - 0.5 * (float(t.max()) + float(t.min()))) / half
    lagged = [Memory().lag("lag", o.time, response, tau) - response for tau in LAGS_S]
    early = np.interp(o.time + EARLY_S, o.time, response) - response
    late = (o.time - o.time[0]) / (o.time[-1] - o.time[0])
    return [response * u, response * u**2, response * late, early, *lagged]
