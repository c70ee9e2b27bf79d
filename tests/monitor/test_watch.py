"""Units by their records: whatever the order, changes and when to calibrate again."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from fogml.monitor.monitor_json import monitor_json
from fogml.monitor.watch import watch
from fogml.report.monitor_page import monitor_page, unit_file, unit_page
from fogml.report.monitor_words import alarm_words, calibration_words, evidence, outlier_words
from tests.monitor.test_store import RECORD


def service(count=20, *, step_at=None, trend=0.0, seed=0, unit="FOG-1"):
    rng = np.random.default_rng(seed)
    records = []
    for day in range(count):
        level = 0.01 * rng.normal() + trend * day + (0.1 if step_at is not None and day >= step_at else 0.0)
        records.append(
            replace(
                RECORD,
                key=f"{unit}{day}",
                unit=unit,
                run=f"{day:02d}.csv",
                started=f"2026-03-{day + 1:02d}T08:00:00+00:00",
                level=level,
                rate_slope=0.001 * rng.normal(),
                scatter=-4.0 + 0.1 * rng.normal(),
            )
        )
    return records


def values_of(units):
    return monitor_json(units, runs_between_false_alarms=1000.0, added=0, repeated=0)


def test_the_order_of_arrival_makes_no_difference():
    records = service(step_at=12)
    (unit,) = watch(records)
    (late,) = watch(list(np.random.default_rng(1).permutation(records)))
    assert json.dumps(values_of([unit])) == json.dumps(values_of([late]))
    assert unit.state == "alarm"
    (change,) = unit.chart.changes
    assert change.onset == 12
    assert change.size == pytest.approx(0.1, abs=0.02)
    (alarm,) = values_of([unit])["units"][0]["alarms"]
    assert alarm["onset"] == "12.csv"
    assert alarm["onset_started"] == "2026-03-13T08:00:00+00:00"
    assert "turn_on_bias" in alarm["nearest"]
    assert "since 2026-03-13" in alarm_words(alarm)


def test_a_drift_that_goes_on_says_so_and_its_end_is_told_off_its_course():
    records = [
        replace(record, level=record.level + 0.03 * min(max(day - 7, 0), 10))
        for day, record in enumerate(service(30))
    ]
    (going,) = values_of(watch(records[:18]))["units"]
    (alarm,) = going["alarms"]
    assert "drifts by" in alarm_words(alarm) and "It goes on." in alarm_words(alarm)
    (ended,) = values_of(watch(records))["units"]
    first, last = ended["alarms"]
    assert "goes on" not in alarm_words(first) and "off its course" not in alarm_words(first)
    assert "off its course" in alarm_words(last)
    assert last["size_ci90"][0] < -0.03 < last["size_ci90"][1]


def test_a_run_that_is_off_alone_is_said_drawn_and_left_out_of_the_trend():
    records = service(20)
    records[6] = replace(records[6], level=records[6].level + 0.3, scatter=-2.0)
    values = values_of(watch(records))
    (unit,) = values["units"]
    assert unit["state"] == "steady" and not unit["alarms"]
    told = {one["figure"]: one for one in unit["outliers"]}
    assert sorted(told) == ["level", "scatter"] and {one["run"] for one in told.values()} == {"06.csv"}
    assert told["level"]["size_ci90"][0] < 0.3 < told["level"]["size_ci90"][1]
    assert outlier_words(told["level"]).startswith("The bias of 06.csv alone is off by 0.3")
    assert "is 7." in outlier_words(told["scatter"]) and "times the usual" in outlier_words(told["scatter"])
    page = unit_page(unit, 1000.0)
    assert outlier_words(told["level"]) in page
    without, _ = (values_of(watch(some))["units"] for some in (records[:6] + records[7:], records))
    assert unit["calibration"]["trend_ci90"] == pytest.approx(
        without[0]["calibration"]["trend_ci90"], rel=1e-9
    )


def test_units_are_kept_apart():
    units = watch([*service(unit="FOG-2"), *service(step_at=10, seed=1, unit="FOG-10")])
    assert [(u.unit, u.state) for u in units] == [("FOG-10", "alarm"), ("FOG-2", "steady")]


def test_units_that_may_be_one_say_so():
    """A unit's runs under names that read alike: each is too few to tell a change, which nobody was told."""
    names = ("FOG-1", "fog-1 ", "\N{FULLWIDTH LATIN CAPITAL LETTER F}OG-1", "FOG-01", "1")
    notes = {
        unit.unit: " ".join(unit.notes) for unit in watch([r for n in names for r in service(5, unit=n)])
    }
    for name in names[:3]:
        assert all((f"'{other}' x" in notes[name]) == (other != name) for other in names[:3])
    assert not notes["FOG-01"] and not notes["1"]


@pytest.mark.parametrize("started", ["", "2026-03-01T08:00:00+00:00"])
def test_runs_of_one_moment_stand_by_the_numbers_in_their_names(started):
    """Monitored within a second: run 10 stood before run 2, or anywhere where all state one day."""
    records = [replace(one, run=f"run-{n}.csv", started=started) for n, one in enumerate(service(12))]
    (unit,) = watch(records[::-1])
    assert [record.run for record in unit.records] == [f"run-{n}.csv" for n in range(12)]


def test_a_new_model_begins_a_new_chart():
    records = service(step_at=10)
    exchanged = [replace(r, model="new") if i >= 10 else r for i, r in enumerate(records)]
    (unit,) = watch(exchanged)
    assert len(unit.records) == 10
    assert unit.state == "steady"
    assert "exchanged" in unit.notes[0]


def test_when_to_calibrate_again_is_where_the_trend_passes_the_limit():
    (unit,) = watch(service(28, trend=0.002, seed=2), runs_between_false_alarms=1e9, bias_limit=0.2)
    told = unit.calibration
    # 0.2 / 0.002 = 100 days after the first run, 73 after the last.
    assert told.due_ci90[0] < 73.0 < told.due_ci90[1]
    assert told.due_days == pytest.approx(73.0, rel=0.25)
    words = calibration_words(values_of([unit])["units"][0])
    assert words.startswith("Calibrate again in")
    (passed,) = watch(service(28, trend=0.02, seed=2), runs_between_false_alarms=1e9, bias_limit=0.01)
    assert calibration_words(values_of([passed])["units"][0]).startswith("Calibrate now")
    (steady,) = watch(service(28), bias_limit=10.0)
    assert "No trend is seen" in calibration_words(values_of([steady])["units"][0])


def test_runs_without_a_date_stand_as_they_were_monitored():
    records = [replace(r, started="", monitored=f"2026-04-{i + 1:02d}") for i, r in enumerate(service(6))]
    (unit,) = watch(records[::-1])
    assert [r.run for r in unit.records] == [f"{n:02d}.csv" for n in range(6)]
    assert "side files" in unit.notes[0]
    assert unit.calibration is None


def test_a_time_zone_that_some_runs_lack_holds_up_no_other_unit():
    mixed = [replace(r, started=r.started[:19] if i else r.started) for i, r in enumerate(service(6))]
    unit, other = watch([*mixed, *service(6, unit="FOG-2")])
    assert not unit.dated and "time zone" in unit.notes[0] and len(unit.notes) == 1
    assert other.dated and not other.notes


@pytest.mark.parametrize("key", ["A", "z"])
def test_runs_given_again_with_a_new_model_are_those_of_the_new(key):
    """The last run stands under both: before, the smaller digest of the two decided."""
    again = [
        replace(r, key=key + r.key, model="new", monitored="2026-05-01T08:00:00+00:00") for r in service(8)
    ]
    (unit,) = watch([*service(8), *again])
    assert {r.model for r in unit.records} == {"new"} and len(unit.records) == 8


def test_a_last_run_outside_training_widens_no_limit():
    records = service(12)
    (unit,) = watch([*records[:-1], replace(records[-1], half_width=5.0)])
    assert unit.calibration.limit == records[0].half_width


def test_runs_that_tell_no_bias_are_left_out_of_the_calibration():
    records = service(12)
    gone = [
        replace(r, level=float("nan"), level_se=float("nan")) if i in (3, 5) else r
        for i, r in enumerate(records)
    ]
    (unit,), (rest,) = watch(gone), watch([r for i, r in enumerate(records) if i not in (3, 5)])
    assert unit.calibration == rest.calibration
    (nothing,) = watch(
        [replace(r, level=float("nan"), scatter=float("nan"), rate_slope=float("nan")) for r in records]
    )
    assert nothing.calibration is None and "Run by run" in unit_page(values_of([nothing])["units"][0], 1000.0)


@pytest.mark.parametrize(
    "began", ["1970-01-01T00:02:00+00:00", "1980-01-06T01:00:00", "2000-01-03T09:00:00Z"]
)
def test_a_clock_that_was_never_set_dates_no_run(began):
    zone = "" if began[-1] == "0" and "+" not in began else "+00:00"
    records = [replace(r, started=r.started[:19] + zone) for r in service(12)]
    records[4] = replace(records[4], started=began)
    (unit,) = watch(records)
    assert not unit.dated and unit.calibration is None
    assert "04.csv" in unit.notes[0] and "never set" in unit.notes[0]
    # Dated rightly, the unit is as old as its runs are apart.
    (mended,) = watch(service(12))
    assert mended.dated and mended.age[-1] == 11.0 and not any("never set" in note for note in mended.notes)


def test_first_runs_are_a_baseline():
    (unit,) = watch(service(3))
    assert unit.state == "baseline"
    assert "3 runs so far: no change can be told yet, 5 are the least that tell one" in unit.notes


def test_evidence_of_none_is_told_as_none_though_its_axis_has_no_zero():
    drawing = evidence(values_of(watch(service(3)))["units"][0], 1e6)
    assert "at most 0, against a limit of 1000000" in drawing.alt
    assert "below 0.01 is drawn there" in drawing.caption


def test_units_of_first_runs_alone_are_not_said_to_be_unchanged():
    early, steady = service(3, unit="FOG-2"), service(20, unit="FOG-1")
    page = monitor_page(values_of(watch(early)))
    assert "No unit has changed" not in page and "No change can be told yet" in page
    page = monitor_page(values_of(watch([*early, *steady])))
    assert "No unit has changed" in page and "Of 1 unit only the first runs are there" in page
    assert "1 can&#39;t be told yet" in page


def test_pages_show_units_of_any_name():
    records = [*service(step_at=10), *service(2, unit="<b>&/.."), *service(5, unit="")]
    values = values_of(watch(records))
    page = monitor_page(values)
    assert "<b>&/" not in page
    names = {unit_file(unit) for unit in values["units"]}
    assert len(names) == 3
    assert all("/" not in name for name in names)
    for unit in values["units"]:
        assert unit_file(unit) in page
        assert "Run by run" in unit_page(unit, 1000.0)
