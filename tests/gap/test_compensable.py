"""Families as features of a drift model: understood, causal, and wide enough for what the family can do."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.arrays import FloatArray
from fogml.features.grammar import parse_terms
from fogml.features.parse import parse_features
from fogml.gap.compensation import Recorded, _span, constants_features, features_of
from fogml.gap.settings import STANDARD
from fogml.runs.run import Run
from fogml.signals.bases import preisach
from fogml.twin.effect import BiasEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import shared, signed
from fogml.twin.registry import effects

COLUMNS = frozenset(
    {"T_in", "T_out", "T_case", "T_electronics", "T_chamber", "heater", "compressor"}
    | {"supply", "vibration", "humidity", "angle", "B_x"}
)
EVERYTHING = Recorded(COLUMNS, 64.0, True, 80.0)
ONE_SENSOR = Recorded(frozenset({"T"}), 200.0, False, 80.0)
CANDIDATES = {id: declared for id, declared in effects().items() if declared.candidate}


@pytest.mark.parametrize("recorded", [EVERYTHING, ONE_SENSOR], ids=["everything", "one sensor"])
@pytest.mark.parametrize("place", ["", "hub, 600 s late", "recorded electronics", "chamber air"])
def test_every_candidate_is_features_or_a_reason(recorded: Recorded, place: str) -> None:
    for id, declared in CANDIDATES.items():
        form = {"place": place, "period": 9.0, "transition_temperature": 40.0, "width": 5.0}
        features, reason = features_of(declared, [form, {**form, "half_width": 6.0}], recorded)
        assert bool(features) != bool(reason), id
        for text in (*features, *constants_features(recorded)):
            sensors = {
                name for term in parse_terms(text) for atom in term.atoms for name in atom.signal.sensors
            }
            assert sensors <= recorded.columns | {"time_on", "T"}, (id, text)


def test_each_family_of_the_bias_is_a_span() -> None:
    for declared in CANDIDATES.values():
        own = declared.family in ("signature", "ageing") or declared.drawn_per_run
        if declared.stage == "bias" and not own:
            assert _span(declared, {}, EVERYTHING), declared.family


def test_an_effect_of_ones_own_is_the_features_that_it_states() -> None:
    class Late(BiasEffect):
        """A lag of one's own."""

        amplitude = signed("deg/h", (0.05, 2.0), (0.002, 0.1), "", 1e3)
        shape = (shared("mount", "s", (300.0, 3000.0), "", (1.0, 1e5)),)
        needs = ("T",)
        compensated_by = ("T", "lag(T, {mount:g} s)")

        def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
            return inputs.memory.lag(self.id, inputs.time, inputs.temperature("T"), shape["mount"])

    late = Late()
    forms = [{"mount": 600.0}, {"mount": 900.0}]
    texts = ("T", "lag(T, 600 s)", "lag(T, 900 s)")
    assert features_of(late, forms, ONE_SENSOR) == (texts, "")
    late.compensated_by = ("lag(T_electronics, {mount:g} s)",)  # type: ignore[misc]
    assert features_of(late, forms, ONE_SENSOR) == ((), "the runs do not record what drives it")
    assert features_of(late, forms[:1], EVERYTHING) == (("lag(T_electronics, 600 s)",), "")
    late.compensated_by = ()  # type: ignore[misc]
    assert features_of(late, forms, ONE_SENSOR) == ((), "no features that hold it are stated")


def test_powers_of_plays_hold_a_smooth_plane_of_relays() -> None:
    time = np.arange(0.0, 60000.0, 40.0)
    T = 15.0 + 35.0 * np.sin(time / 6000.0) + 12.0 * np.sin(time / 1700.0)
    rng = np.random.default_rng(3)
    plane = [preisach(T, float(T.min()), float(T.max()), w) for w in STANDARD.grids.half_widths_degc]
    loop = sum(columns @ (1.0 + rng.uniform(-0.6, 0.6, columns.shape[1])) for columns in plane)
    texts, _ = features_of(CANDIDATES["thermal_hysteresis"], [{}], ONE_SENSOR)
    columns = parse_features(", ".join(["T", "T^2", *texts])).transform(
        Run("r", {"time": time, "gyro": 0.0 * time, "T": T})
    )
    design = np.column_stack([np.ones(len(time)), columns / np.abs(columns).max(axis=0)])
    half = slice(len(time) // 4, None)
    left = loop[half] - design[half] @ np.linalg.lstsq(design[half], loop[half], rcond=1e-10)[0]
    assert np.std(left) < 0.03 * np.std(loop[half])
