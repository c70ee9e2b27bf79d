"""The page of a diagnosis: the verdict at one look, the right figures, and honest words."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fogml.gap.result import Diagnosis, HowFar
from fogml.gap.result_parts import GapSegment, Where, beyond_noise
from fogml.gap.sentences import headline
from fogml.gap.settings import STANDARD
from fogml.numerals import MISSING, probability_words, unit_words, with_error
from fogml.report.gap_page import MOST_RUNS_DRAWN, gap_page
from fogml.report.gap_tables import causes_table, constants_table, segments_table
from fogml.twin.registry import effect, effects
from tests.report.diagnoses import FLOOR, diagnosis, every_diagnosis, hysteresis, series
from tests.report.pages import Page

VERDICTS = ("explained", "ambiguous", "partly_explained", "unknown", "no_gap")


@cache
def page(verdict: str) -> Page:
    found = every_diagnosis()[verdict]
    return Page(gap_page(replace(found, headline=said(found))))


def said(found: Diagnosis) -> tuple[str, ...]:
    """The sentences of a diagnosis of one run whose noise is known."""
    run = SimpleNamespace(run=SimpleNamespace(name="a.csv"))
    scene = SimpleNamespace(candidates=effects(), runs=[run], in_time=[0])
    points = SimpleNamespace(static=object(), steps=((0.0, 0.0),), best=0)
    behind = SimpleNamespace(scene=scene, points=points, setting=SimpleNamespace(priors=STANDARD))
    behind.columns = SimpleNamespace(families=())
    return headline(behind, found, False)


def tiles(read: Page) -> str:
    """What stands between the heading and the first section: the first screen."""
    return read.text[: read.text.index("Which effect")]


@pytest.mark.parametrize("verdict", VERDICTS)
def test_one_look_tells_verdict_cause_confidence_and_closing(verdict: str) -> None:
    first = tiles(page(verdict))
    assert {
        "explained": "Explained. Missing from the twin: Thermal hysteresis of the bias",
        "ambiguous": "Ambiguous. Missing from the twin: Thermal hysteresis of the bias or Lag of the",
        "partly_explained": "Partly explained. Missing from the twin: Thermal hysteresis of the bias, and",
        "unknown": "Unknown: the gap is there, and no candidate explains it",
        "no_gap": "No gap: the recalibrated twin and the gyro agree within the noise",
    }[verdict] in first
    assert {"unknown": "Confidence 91 %", "no_gap": "Likeliest effect"}.get(
        verdict, "Confidence 97 %"
    ) in first
    assert {"unknown": "Closed 0 %", "no_gap": "Closed –"}.get(
        verdict, "Closed 98 % 90 %: 96 … 100 %"
    ) in first
    if verdict in ("unknown", "partly_explained"):
        assert "follows the direction of temperature change" in first


def test_a_gap_without_a_sure_cause_names_the_likeliest() -> None:
    found = every_diagnosis()["unknown"]
    doubtful = replace(found, unknown=replace(found.unknown, probability=0.37))
    first = tiles(Page(gap_page(doubtful)))
    assert "no candidate is sure to explain it" in first
    likeliest = max(found.evidence, key=lambda e: e.probability)
    told = f"{probability_words(likeliest.probability)} {effect(likeliest.effect).title}"
    assert f"Likeliest effect {told} Something unknown 37 %" in first


def test_a_stage_is_of_what_was_found_only_where_something_is_named() -> None:
    told = "in which what was found acts"
    assert told in page("explained").text and told not in page("unknown").text
    assert "by its looks: no cause is named" in page("unknown").text


def test_what_is_suspected_is_told_with_its_probability_and_is_no_name() -> None:
    found = every_diagnosis()["unknown"]
    suspected = replace(every_diagnosis()["explained"].found[0], probability=0.72)
    first = tiles(Page(gap_page(replace(found, suspected=(suspected,)))))
    title = effect(suspected.effect).title
    assert f"Suspected, and not sure enough to be named: {title} (72 %)" in first
    assert "Missing from the twin" not in first and "Suspected" not in tiles(page("unknown"))


def test_the_table_of_causes_marks_what_is_suspected_and_highlights_names_alone() -> None:
    found = every_diagnosis()["explained"]
    named = found.found[0]
    suspected = replace(named, effect="moisture", members=("moisture",), probability=0.72)
    table = causes_table(replace(found, suspected=(suspected,)), {})
    assert table is not None
    assert [(row.cells[0].startswith("Suspected: "), *row.cells[1:2], row.mark) for row in table.rows] == [
        (False, probability_words(named.probability), "chosen"),
        (True, "72 %", ""),
    ]
    assert causes_table(replace(found, found=()), {}) is None


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_axis_has_a_unit_and_every_figure_words(verdict: str) -> None:
    read = page(verdict)
    plots = [a for a in read.of("div") if "plot" in (a.get("class") or "").split()]
    assert len(plots) == len(read.figures) >= 7
    assert all(len(plot["aria-label"] or "") > 40 for plot in plots)
    for figure in read.figures:
        axes = [v for k, v in figure["layout"].items() if re.fullmatch(r"[xy]axis\d*", k)]
        told = [axis["title"]["text"] for axis in axes if axis.get("title", {}).get("text")]
        assert told and all("[" in title for title in told)


@pytest.mark.parametrize("verdict", VERDICTS)
def test_nothing_depends_on_colour_alone(verdict: str) -> None:
    for figure in page(verdict).figures:
        looks: dict[tuple[str, ...], str] = {}
        for trace in figure["data"]:
            if trace["type"] == "bar":
                look = (trace.get("yaxis", "y"), "bar", str(trace["marker"].get("pattern", {}).get("shape")))
            elif trace.get("showlegend") is False or trace.get("fill"):
                continue
            else:
                line, marker = trace.get("line", {}), trace.get("marker", {})
                look = (
                    trace.get("yaxis", "y"),
                    trace["mode"],
                    f"{line.get('dash', 'solid')}{line.get('width')}",
                    str(marker.get("symbol")),
                )
            assert looks.setdefault(look, trace["name"]) == trace["name"]


def test_nothing_is_loaded_and_no_name_becomes_markup() -> None:
    name = "</script><script>alert(1)</script>.csv"
    html = gap_page(diagnosis(fit=(name,), series=(series(name), series("c.csv", "held_out"))))
    assert "<script>alert" not in html and name in Page(html).text
    for _, attributes in Page(html).elements:
        assert "src" not in attributes
        assert not re.match(r"(?i)(\w+:)?//", attributes.get("href") or "")
    assert len(html) < 7_000_000


def test_figures_of_the_diagnosis_are_on_the_page() -> None:
    text = page("explained").text
    for told in ("2.31", "0.0361", "0.00790", "0.00750", "98 %", "0.0214 ± 0.0011", "9.12 ± 0.43 °C"):
        assert told in text
    assert "agree in sign and size (2 runs)" in text
    assert "5400 9000 60.0 min 0.0330" in text
    assert "Place of the temperature sensors" in text and "Nothing is said of these" in text
    assert "Earth rate is known." in text
    assert "a.csv, b.csv and c.csv: synthetic: programme cycle" in text
    assert "FOG-0417, axis x" in text


def test_look_alikes_come_with_what_separates_them() -> None:
    text = page("ambiguous").text
    assert effect("thermal_hysteresis").confused_with["sensor_lag"] in text
    assert "11.5 h" in text and "6.2 standard deviations" in text and "soak at 25 degC for 1 h" in text
    assert "schema: fogml.programme/1" in text and "one ramp rate 9.00 h 4.1" in text
    assert "What looks alike" not in page("explained").text


def test_segments_are_drawn_where_they_are() -> None:
    drawn = [
        trace
        for figure in page("explained").figures
        for trace in figure["data"]
        if trace.get("name") == "over the floor"
    ]
    assert len(drawn) == 1
    assert drawn[0]["x"][:2] == [1.5, 2.5]


def test_of_many_segments_those_of_most_excess_are_listed_in_their_order() -> None:
    found = diagnosis()
    many = tuple(GapSegment("a.csv", 1000.0 * k, 1000.0 * k + 500.0, 0.01 * (1 + k % 7)) for k in range(14))
    table = segments_table(replace(found, where=replace(found.where, segments=many)))
    assert table is not None and len(table.rows) == 12 and "2 smaller ones" in table.caption
    kept = [float(row.cells[1]) for row in table.rows]
    assert kept == sorted(kept) and not {0.0, 7000.0} & set(kept)


def test_a_gap_in_time_is_drawn_as_recorded_less_replayed() -> None:
    wanted = series("c.csv", "held_out")
    figure = next(f for f in page("explained").figures if any(t.get("name") == "recorded" for t in f["data"]))
    held = {t.get("name"): t for t in figure["data"]}
    gap = decoded(held["gap, recalibrated"]["y"])
    apart = decoded(held["recorded"]["y"]) - decoded(held["recalibrated twin"]["y"])
    # Samples are in single precision.
    np.testing.assert_allclose(gap, apart, rtol=1e-5, atol=1e-5 * np.ptp(decoded(held["recorded"]["y"])))
    np.testing.assert_allclose(gap, wanted.gap_recalibrated, rtol=1e-6, atol=1e-6)


def decoded(values: object) -> np.ndarray:
    """Numbers of a trace: plotly writes arrays in base 64."""
    if isinstance(values, dict):
        import base64

        return np.frombuffer(base64.b64decode(values["bdata"]), dtype=values["dtype"])
    return np.asarray(values, dtype=np.float64)


def test_what_was_not_held_out_is_said_first() -> None:
    kept = Page(gap_page(diagnosis(held_out=("b.csv",), held_out_is_part=True)))
    assert "No run was held out. The last stretch of b.csv was kept back" in tiles(kept)
    none = Page(gap_page(diagnosis(held_out=(), how_far=(), series=(series("a.csv"),))))
    assert "No run could be held out" in tiles(none) and "nothing was held out" in tiles(none)


def test_doubts_are_warned_of() -> None:
    base = diagnosis(
        found=(hysteresis(consistent=False),), unusable=(("short.csv", "short.csv: lasts 100 s"),)
    )
    noise = replace(
        base.noise, white=False, failed=("the variance of means over 80 s is 3 times as expected",)
    )
    far = (HowFar("c.csv", 100.0, 2.3, 0.01, 0.01, 0.05, None, None, "at the floor"),)
    first = tiles(Page(gap_page(replace(base, noise=noise, how_far=far))))
    assert "does not show with the same sign and size on every run" in first
    assert "short.csv was not used: lasts 100 s." in first
    assert "The noise check fails" in first and "over 80 s is 3 times" in first
    assert "it overstates slow noise" in first
    (worse,) = (replace(item, after=0.05) for item in base.how_far)
    assert "makes the replay of c.csv worse: 0.0500" in tiles(Page(gap_page(replace(base, how_far=(worse,)))))
    assert "Mind:" not in tiles(page("explained"))


def test_a_name_that_closes_nothing_is_no_explanation() -> None:
    worse = HowFar("c.csv", 100.0, 0.01, 0.02, 0.0205, 0.0075, -0.09, (-0.2, 0.02))
    page = gap_page(diagnosis(how_far=(worse,)))
    assert "Named, and the gap does not close on c.csv" in page and "<h1>Explained" not in page
    assert "Constants as fitted make the replay of c.csv worse" in page


@pytest.mark.parametrize(
    ("before", "recalibrated", "closed", "said"),
    [
        # A deadband of another size: constants take it up where it acts, and held-out runs pay for it.
        (
            0.43,
            0.58,
            0.0,
            "leaves 0.580 deg/h, more than the 0.430 of the twin as given, where noise makes 0.0",
        ),
        (0.60, 0.58, 0.0, "on c.csv the recalibrated twin leaves 0.580 deg/h where noise makes 0.0075"),
        (0.0073, 0.0078, None, ""),
    ],
)
def test_no_gap_is_not_said_of_held_out_runs_that_stand_out_of_noise(
    before, recalibrated, closed, said
) -> None:
    far = HowFar("c.csv", 100.0, before, recalibrated, recalibrated, FLOOR, closed, None)
    first = tiles(Page(gap_page(diagnosis("no_gap", how_far=(far,)))))
    assert said in first and beyond_noise((far,)) in first
    assert ("agree within the noise" in first) == (not said)
    assert ("No cause stands out of the fitted runs" in first) == bool(said)


@pytest.mark.parametrize(("probability", "unknown", "sure"), [(0.46, 0.29, False), (0.06, 0.05, True)])
def test_no_gap_is_said_for_certain_where_nothing_is_likelier_than_something(
    probability, unknown, sure
) -> None:
    cause = replace(hysteresis(), probability=probability)
    held = every_diagnosis()["no_gap"]
    found = replace(held, found=(cause,), unknown=replace(held.unknown, probability=unknown))
    first = tiles(Page(gap_page(found)))
    assert ("agree within the noise" in first) == sure
    assert ("No gap for certain; suspected: Thermal hysteresis of the bias" in first) == (not sure)
    assert ("not for certain" in first) == (not sure)
    first_sentence = said(replace(found, how_far=()))[0]
    assert first_sentence.startswith("Nothing is missing" if sure else "Nothing is sure enough to be named")


def test_of_several_held_out_runs_the_worst_is_told() -> None:
    (far,) = diagnosis().how_far
    both = (far, replace(far, run="d.csv", closed=0.61, closed_ci90=(0.5, 0.7)))
    first = tiles(Page(gap_page(diagnosis(how_far=both, held_out=("c.csv", "d.csv")))))
    assert "Closed 61 % 90 %: 50 … 70 %; the least of 2 held-out runs: d.csv" in first


def test_of_many_runs_those_with_most_of_the_gap_are_drawn() -> None:
    names = tuple(f"run-{i:02d}.csv" for i in range(12))
    quiet = replace(series(names[3]), gap_recalibrated=np.zeros(240))
    every = tuple(quiet if name == names[3] else series(name) for name in names)
    read = Page(gap_page(diagnosis(fit=names, series=(*every, series("c.csv", "held_out")), where=Where())))
    assert read.text.count(", fitted on") == MOST_RUNS_DRAWN - 1
    assert f"{names[3]}, fitted on" not in read.text and "Not drawn, with less of the gap" in read.text


def test_an_effect_of_another_model_needs_no_card() -> None:
    found = hysteresis(("own_effect", "other_effect"), effect="own_effect")
    text = Page(gap_page(diagnosis("ambiguous", (found,)))).text
    assert "Own effect" in text and "Other effect" in text and "the cards name no simple test" in text


def test_every_unit_of_the_catalogue_is_written_for_people() -> None:
    for declared in effects().values():
        for quantity in (declared.amplitude, *declared.shape):
            words = unit_words(quantity.unit)
            assert "degC" not in words and "sqrt" not in words and words != "1"


@given(st.floats(0.0, 1.0 + 1e-12))
def test_a_probability_is_never_told_as_certainty(probability: float) -> None:
    words = probability_words(probability)
    share = float(re.findall(r"\d+", words)[0])
    assert 1.0 <= share <= 99.0
    assert words.endswith(" %") and abs(share - 100.0 * probability) <= 1.0 + 1e-9


@given(st.floats(-1e3, 1e3), st.floats(1e-5, 1e2))
def test_a_value_and_its_error_are_rounded_alike(value: float, se: float) -> None:
    told = with_error(value, se).replace("−", "-")
    first, second = (float(part) for part in told.split(" ± "))
    assert second == pytest.approx(se, rel=0.06)
    assert abs(first - value) <= 0.06 * se


@pytest.mark.parametrize(
    ("prior_sd", "se", "learnt"), [(0.5, 0.1, "80"), (2.0, 3.0, "0"), (0.0, 0.1, MISSING)]
)
def test_what_runs_taught_of_a_constant_is_by_how_much_its_prior_narrowed(prior_sd, se, learnt):
    fields = {"name": "b0", "unit": "deg/h", "prior_mean": 0.0, "value": 0.3}
    constant = SimpleNamespace(**fields, prior_sd=prior_sd, se=se)
    (row,) = constants_table(SimpleNamespace(constants=[constant])).rows
    assert str(row.cells[-1]).startswith(learnt)
