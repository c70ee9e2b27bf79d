"""Several units: causes shared, sizes each unit's own, what the next unit may have."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap import units
from fogml.gap.diagnosis import diagnose
from fogml.gap.model import EffectValue
from fogml.gap.result import Estimate
from fogml.gap.units import diagnose_units
from fogml.runs.facts import Facts
from fogml.signals.restricted import next_value
from fogml.twin.registry import effect
from fogml.twin.twin import EffectSetting

from .test_own_simulator import Simulator, made_runs


def _of(unit, size, seed, count=2):
    effects = (EffectValue("bend", size, {"centre_temperature": 17.0, "width": 5.0}),) if size else ()
    made = made_runs(effects, seed=seed)[:count]
    return [run.with_facts(Facts(unit=unit)) for run in made]


def test_weak_causes_of_two_units_are_surer_together_whatever_their_order(monkeypatch):
    model, runs = Simulator(offered=("bend", "creep")), {"A": _of("A", 0.1, 5), "B": _of("B", 0.14, 6)}
    known = {}

    def inferred(model, fit, *given):
        """Each unit's own posterior once: it does not depend on the others."""
        unit = fit[0].facts.unit
        known[unit] = known.get(unit) or units_inferred(model, fit, *given)
        return known[unit]

    units_inferred = units.inferred
    monkeypatch.setattr(units, "inferred", inferred)
    both = [diagnose_units(model, [*runs[a], *runs[b]]) for a, b in (("A", "B"), ("B", "A"))]
    (cause,), (turned,) = (found.shared for found in both)
    assert cause.effect == turned.effect == "bend"
    assert cause.probability == pytest.approx(turned.probability, rel=1e-9)
    assert cause.mean.value == pytest.approx(turned.mean.value, rel=1e-9)
    for unit, size in (("A", 0.1), ("B", 0.14)):
        assert abs(cause.sizes[unit].value - size) < 4.0 * cause.sizes[unit].se
        alone = units.answered(known[unit], None, True, 0, 1.0)
        own = next((f.probability for f in alone.found if f.effect == "bend"), 0.0)
        (told,) = (f.probability for f in both[0].by_unit[unit].found if f.effect == "bend")
        assert told > own
    assert cause.next_unit[0] < 0.12 < cause.next_unit[1]
    assert "the next unit's lies between" in both[0].lines()[0]


def test_units_that_are_not_told_or_have_no_run_to_fit_on_are_refused():
    (run, _), (held, _) = _of("A", 0.0, 5), _of("B", 0.0, 6)
    with pytest.raises(InputError, match="does not say its unit"):
        diagnose_units(Simulator(), [run, held.with_facts(Facts())])
    with pytest.raises(InputError, match="unit B has runs, and none to fit on"):
        diagnose_units(Simulator(), [run], [held])
    with pytest.raises(InputError, match="diagnose one unit at a time"):
        diagnose(Simulator(), [run, held])


def test_a_unit_whose_runs_cannot_show_a_cause_says_nothing_of_it():
    """Loud as its output is, it would take far more than a usual size to be seen: no such size is told."""
    model, quiet = Simulator(offered=("bend", "creep")), _of("A", 0.6, 5)
    loud = [run.with_columns(gyro=3e3 * run.gyro) for run in _of("B", 0.0, 6)]
    found = diagnose_units(model, [*quiet, *loud])
    assert [(cause.effect, list(cause.sizes)) for cause in found.shared] == [("bend", ["A"])]
    (alone,) = diagnose_units(model, quiet).shared
    assert found.shared[0].probability == pytest.approx(alone.probability, rel=1e-6)
    assert not [f for f in found.by_unit["B"].named if f.effect == "bend"]


def test_the_next_units_size_is_a_possible_one():
    """A deviation over runs is none below nought, a dead zone neither, but it may be less than a twin's."""
    candidates = {id: effect(id) for id in ("turn_on_bias", "deadband", "thermal_hysteresis")}
    has = [(candidates["deadband"], EffectSetting(0.2))]
    sizes = {"A": Estimate(0.1, 0.2, "deg/h"), "B": Estimate(0.3, 0.2, "deg/h")}
    free = next_value([0.1, 0.3], [0.2, 0.2])
    assert free[0] < -0.2
    for on, id, least in (
        ([], "turn_on_bias", 0.0),
        (has, "deadband", -0.2),
        ([], "thermal_hysteresis", free[0]),
    ):
        found = SimpleNamespace(scene=SimpleNamespace(candidates=candidates), plant=SimpleNamespace(on=on))
        _, _, (low, high) = units._going_over(sizes, "deg/h", units._possible(found, id))
        assert (low, high) == pytest.approx((least, free[1]))


@dataclass(frozen=True)
class Kept:
    """A set of causes that a search kept, by family."""

    named: tuple[int, ...]
    by_noise: tuple[float, ...]
    log_evidence: float = 0.0

    @property
    def score(self):
        return float(np.logaddexp.reduce(self.by_noise))


def test_what_a_unit_says_of_a_set_is_the_sum_of_what_it_kept_of_it_else_of_one_made_for_it():
    """Bend was kept alone and beside what is unknown; creep never, it is less likely than the best."""
    kept = [Kept((0,), (-1.0, -1.5)), Kept((0, 2), (-2.0,)), Kept((), (-3.0,), -1.2)]
    search = SimpleNamespace(
        names=lambda e: e.named,
        families_of=lambda kind: (0, 1),
        log_odds=(-2.0, -1.5, -0.5),
        grown=lambda e, more: Kept((*e.named, *more), (0.0,), -7.0),
    )
    found = SimpleNamespace(
        explanations=kept,
        search=search,
        columns=SimpleNamespace(families=[SimpleNamespace(id=id) for id in ("bend", "creep", "unknown")]),
        setting=SimpleNamespace(priors=SimpleNamespace(least_size=0.1)),
        field=SimpleNamespace(shows=lambda family, least: True),
    )
    told = units._Told(found)
    assert told.sets == {frozenset(), frozenset({"bend"})}
    assert told.score(frozenset({"bend"})) == pytest.approx(np.log(np.exp([-1.0, -1.5, -2.0]).sum()) + 2.0)
    assert told.score(frozenset({"creep"})) == pytest.approx(np.log(np.exp([-8.0, -8.5]).sum()) + 1.5)
    assert told.score(frozenset()) == pytest.approx(-3.0)
