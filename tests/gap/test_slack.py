"""Room for an effect's form: what is another form of a line, and what is another line."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.gap.basis import build_basis
from fogml.gap.model import EffectValue
from fogml.gap.slack import NEAR_CYCLES, slack_columns
from tests.gap.small_model import SmallModel, framed, noise_of, ramps, recorded

MODEL = SmallModel(("line",))
SLOW = {"period": 3000.0, "phase": 40.0}
FAST = {"period": 400.0, "phase": 10.0}


@pytest.fixture(scope="module")
def basis():
    run = ramps("a", count=500)
    lines = (EffectValue("line", 0.3, SLOW), EffectValue("line", 0.2, FAST))
    run = recorded(run, MODEL, {}, lines, noise_of(run, np.random.default_rng(3)))
    frame = framed([run], MODEL)
    return build_basis(frame, MODEL.candidates(), (), MODEL.grade)


def share_held(space, columns):
    """Share of the columns' squares that lies within a space."""
    axes = np.linalg.qr(space)[0]
    return np.sum((axes.T @ columns) ** 2) / np.sum(columns**2)


@pytest.mark.parametrize("shape", [SLOW, FAST])
def test_a_line_far_away_is_no_other_form_of_a_line(basis, shape):
    (o,), span = basis.frame.observations, basis.frame.spans["s"]
    apart = [abs(n.node.frequency_hz - 1.0 / shape["period"]) * span for n in basis.nodes]
    slack = slack_columns(basis, int(np.argmin(apart)))
    far = [n for n, cycles in zip(basis.nodes, apart) if cycles > 2.0 * NEAR_CYCLES]
    assert len(far) >= 5
    assert max(share_held(slack, basis.rows[:, list(n.columns)]) for n in far) < 0.35

    # One that is off by a quarter of a cycle over the run is.
    off = {**shape, "period": 1.0 / (1.0 / shape["period"] + 0.25 / span)}
    near = basis.frame.white(
        [np.column_stack([o.response("line", {**off, "phase": p}, {}) for p in (0.0, 90.0)])]
    )
    own = basis.rows[:, list(basis.nodes[int(np.argmin(apart))].columns)]
    assert share_held(np.column_stack([slack, own]), near) > 0.99
