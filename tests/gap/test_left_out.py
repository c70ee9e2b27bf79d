"""Doubt for effects that are no candidates and look like what is named."""

from __future__ import annotations

import pytest

from fogml.gap import diagnose
from fogml.gap.left_out import doubted
from fogml.gap.result import Estimate, Found, Unknown
from fogml.gap.twin_model import TwinModel
from fogml.report import gap_page
from fogml.twin.programme import load_programme
from fogml.twin.twin_file import load_twin

TWIN = load_twin("nominal")


def found(probability: float, left_out: tuple[str, ...], members: tuple[str, ...] = ("a",)) -> Found:
    return Found("a", "bias", members, probability, Estimate(1.0, 0.1, "deg/h"), left_out=left_out)


def test_without_a_look_alike_nothing_changes():
    unknown = Unknown(0.1, "")
    assert doubted(unknown, [found(0.9, ())]) is unknown


@pytest.mark.parametrize(
    ("members", "left_out", "share"),
    [(("a",), ("x",), 0.5), (("a", "b"), ("x",), 1 / 3), (("a",), ("x", "y"), 2 / 3)],
)
def test_look_alikes_count_as_likely_as_the_members_of_the_class(members, left_out, share):
    told = doubted(Unknown(0.1, ""), [found(0.9, left_out, members)])
    assert told.probability == pytest.approx(1.0 - 0.9 * (1.0 - 0.9 * share))
    assert all(id in told.looks_like for id in left_out)


@pytest.fixture(scope="module")
def lines():
    """Runs of a unit with the line of a supply's ripple, as any other oscillation may make it."""
    steps = load_programme(
        ["soak at 25 degC for 1 h", "ramp to 45 degC at 0.5 degC/min", "soak at 45 degC for 2 h"]
    )
    unit = TWIN.with_effect("supply_ripple", 0.5, ripple=0.1, alias_frequency=1.0 / 600.0)
    return [unit.simulate(steps, sample_s=10.0, seed=seed).run for seed in range(3)]


def diagnosed(lines, twin, without=()):
    a, b, c = lines
    return diagnose(twin, [a, b], [c], without=without, plan=False)


def test_a_line_may_be_the_other_effect_that_makes_lines(lines):
    """With one phase on both runs the left-out one looks exactly like the one that is named."""
    told = diagnosed(lines, TWIN, ["supply_ripple"])
    (one,) = told.named
    assert one.effect == "sinusoidal" and one.left_out == ("supply_ripple",)
    assert told.unknown.probability > 0.4 and "supply_ripple" in told.unknown.looks_like
    assert told.as_dict()["which"][0]["left_out"] == ["supply_ripple"]
    page = gap_page(told)
    assert "was left out of the candidates" in page


def test_an_unlike_effect_or_one_that_nobody_knows_of_gives_no_doubt(lines):
    unlike = diagnosed(lines, TWIN, ["magnetic"])
    unheard_of = diagnosed(lines, TwinModel(TWIN, ["supply_ripple"]))
    # The supply stands still: nothing tells its ripple from any other line.
    assert "supply_ripple" in unlike.undetectable
    for told in (unlike, unheard_of):
        assert [f.effect for f in told.named] == ["sinusoidal"]
        assert told.named[0].left_out == () and told.unknown.probability < 0.4


def test_a_lines_frequency_is_known_to_a_share_of_its_resolution(lines):
    """A replay can't show a line of any phase: the frequency is as exact as the periodogram tells it."""
    (one,) = diagnosed(lines, TwinModel(TWIN, ["supply_ripple"])).named
    frequency, phase = one.parameters["frequency"], one.parameters["phase"]
    resolution = 1.0 / lines[0].span_s
    assert abs(frequency.value - 1.0 / 600.0) < 3.0 * frequency.se < resolution
    assert phase.se == pytest.approx(360.0 / 12.0**0.5)
