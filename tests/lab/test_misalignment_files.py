"""Files of the misalignment procedure: every documented form gives the same turns; faults are named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.lab_uncertainty import misalignment as simulated
from fogml.errors import InputError
from fogml.lab.misalignment import TableMeasurements, decouple
from fogml.lab.misalignment_input import read_measurements
from fogml.lab.misalignment_segments import from_samples
from fogml.lab.misalignment_simulation import TableUnit, measurements, samples

UNIT = TableUnit(K=1.2345, delta_x_deg=5.0, delta_y_deg=3.0, fixture_error_deg=0.5)
TILTS, RATES = (0.0, 30.0, 60.0, 90.0), (10.0, -10.0, 50.0, -50.0)
HEADER = "state,tilt [deg],rate [deg/s],segment,output [V]"


def lines(*, rate_on_rests: bool = True, shared_rests: bool = False) -> list[str]:
    """Averages with a bias that drifts from row to row, so that a wrong rest shows."""
    turns = measurements(UNIT, TILTS, RATES)
    rows, level = [], 0.2
    for number, (state, tilt, rate, value) in enumerate(
        zip(turns.state, turns.tilt_deg, turns.rate_deg_s, turns.output)
    ):
        stated = rate if rate_on_rests else 0.0
        first = number % len(RATES) == 0
        marks = [("before", stated, 0.0)] if first or not shared_rests else []
        marks += [("turn", rate, value), ("after", stated, 0.0)]
        for mark, told, added in marks:
            level += 1e-3
            rows.append(
                f"{state:g},{tilt:g},{told:g},{mark},{level + added!r}".replace("np.float64(", "").rstrip(")")
            )
    return rows


def written(tmp_path: Path, rows: list[str], header: str = HEADER) -> Path:
    path = tmp_path / "table.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


@pytest.mark.parametrize("rate_on_rests", [True, False])
@pytest.mark.parametrize("shared_rests", [True, False])
def test_marked_averages(tmp_path: Path, rate_on_rests: bool, shared_rests: bool) -> None:
    path = written(tmp_path, lines(rate_on_rests=rate_on_rests, shared_rests=shared_rests))
    turns = read_measurements(path)
    assert turns.unit == "V" and len(turns.output) == 64
    found = decouple(turns)
    np.testing.assert_allclose(found.K, 1.2345, rtol=1e-9)
    assert (found.delta_x_deg, found.delta_y_deg) == pytest.approx((5.0, 3.0), abs=1e-8)


def test_rows_in_another_order_are_matched_by_their_rate(tmp_path: Path) -> None:
    rows = lines()
    np.random.default_rng(1).shuffle(rows)
    np.testing.assert_allclose(decouple(read_measurements(written(tmp_path, rows))).K, 1.2345, rtol=1e-9)


def test_averages_without_marks(tmp_path: Path) -> None:
    rows = [
        ",".join(r.split(",")[:3] + r.split(",")[4:]) for r in lines(rate_on_rests=False, shared_rests=True)
    ]
    path = written(tmp_path, rows, HEADER.replace("segment,", ""))
    assert decouple(read_measurements(path)).delta_x_deg == pytest.approx(5.0, abs=1e-8)


def test_other_units_and_separators(tmp_path: Path) -> None:
    rows = []
    for row in lines():
        state, tilt, rate, mark, output = row.split(",")
        values = (state, repr(float(np.radians(float(tilt)))), repr(float(rate) * 3600.0), mark, output)
        rows.append(";".join(values).replace(".", ","))
    path = written(tmp_path, rows, "state;tilt [rad];rate [deg/h];segment;output [mV]")
    turns = read_measurements(path)
    assert turns.unit == "mV"
    np.testing.assert_allclose(decouple(turns).K, 1.2345, rtol=1e-9)


def test_a_run_of_samples_with_noise(tmp_path: Path) -> None:
    rows, time = samples(
        UNIT, TILTS, (36.0, 72.0), noise=1e-4, sample_s=0.2, acceleration_deg_s2=40.0, seed=2
    )
    columns = (time, rows.output, rows.state, rows.tilt_deg, rows.rate_deg_s)
    path = tmp_path / "run.csv"
    header = "time [s],gyro [deg/h],state,tilt [deg],rate [deg/s]"
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.10g")
    found = decouple(read_measurements(path))
    assert found.se is not None
    assert abs(found.K - 1.2345) < 5 * found.se["K"] < 1e-5
    assert abs(found.delta_x_deg - 5.0) < 5 * found.se["delta_x_deg"] < 1e-3


@pytest.mark.parametrize("late_s", [-2.0, 5.0])
def test_a_table_on_another_clock_tells_the_same(late_s: float) -> None:
    rows, time = samples(
        UNIT, TILTS, (36.0, 72.0), noise=1e-4, sample_s=0.2, acceleration_deg_s2=40.0, seed=2
    )
    recorded = np.interp(time - late_s, time, rows.rate_deg_s)
    found = decouple(from_samples(replace(rows, rate_deg_s=recorded), time))
    assert found.se is not None
    assert abs(found.K - 1.2345) < 5 * found.se["K"] < 1e-5
    assert abs(found.delta_x_deg - 5.0) < 5 * found.se["delta_x_deg"] < 1e-3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.replace(",output [V]", ",signal [V]"), "no column 'output'"),
        (lambda t: t.replace("state,", "mode,", 1), "no column 'state'"),
        (lambda t: t.replace("tilt [deg]", "tilt"), "column 'tilt' states no unit"),
        (lambda t: t.replace("rate [deg/s]", "rate [rpm]"), "column 'rate' has unit 'rpm'"),
        (lambda t: t.replace("output [V]", "output"), "column 'output' states no unit"),
        (lambda t: t.replace("\n2,30,", "\n7,30,"), "7 is no mounting state"),
        (
            lambda t: t.replace("\n2,30,10,turn,", "\n2,30,nan,turn,"),
            "column 'rate', line .*missing or not finite",
        ),
        (lambda t: t.replace(",turn,", ",spin,", 1), "'spin' is no segment"),
        (lambda t: t.replace(",turn,", f",{'x' * 200_000},", 1), "line 3: not readable as CSV"),
        (lambda t: t.replace("\n3,", "\n1,"), "no turns in state 3"),
    ],
)
def test_faults_are_named(tmp_path: Path, change, message: str) -> None:
    path = tmp_path / "table.csv"
    text = change("\n".join([HEADER, *lines()]) + "\n")
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        decouple(read_measurements(path))
    assert "table.csv" in str(caught.value)


def turned_file(tmp_path: Path, angles: tuple[float, ...], unit: str | None) -> Path:
    turns = measurements(UNIT, TILTS, RATES, state_angles_deg=angles)
    rows = []
    for state, tilt, rate, output in zip(turns.state, turns.tilt_deg, turns.rate_deg_s, turns.output):
        angle = angles[int(state) - 1]
        told = f"{np.radians(angle) if unit == 'rad' else angle:.12g}," if unit else ""
        for mark, value in (("before", 0.2), ("turn", 0.2 + output), ("after", 0.2)):
            rows.append(f"{told}{state:g},{tilt:g},{rate:g},{mark},{value:.15g}")
    return written(tmp_path, rows, (f"state_angle [{unit}]," if unit else "") + HEADER)


@pytest.mark.parametrize("unit", ["deg", "rad"])
def test_turns_of_the_states_from_a_column(tmp_path: Path, unit: str) -> None:
    found = decouple(read_measurements(turned_file(tmp_path, (0.0, 90.0, 180.0, 270.0), unit)))
    assert (found.delta_x_deg, found.delta_y_deg) == pytest.approx((5.0, 3.0), abs=1e-8)


def test_turns_of_the_states_given_and_faults(tmp_path: Path) -> None:
    angles = (0.0, 90.0, 180.0, 270.0)
    bare = turned_file(tmp_path, angles, None)
    assert decouple(read_measurements(bare, angles)).delta_y_deg == pytest.approx(3.0, abs=1e-8)
    with pytest.raises(InputError, match=r"table\.csv: the turns contradict"):
        decouple(read_measurements(bare))
    with pytest.raises(InputError, match="four angles"):
        read_measurements(bare, (0.0, 90.0))
    own = turned_file(tmp_path, angles, "deg")
    with pytest.raises(InputError, match="leave one of the two out"):
        read_measurements(own, (0.0, 180.0, 270.0, 90.0))
    own.write_text(own.read_text().replace("90,2,30,10,turn", "91,2,30,10,turn"))
    with pytest.raises(InputError, match=r"column 'state_angle', line .*91 deg in state 2, 90 deg"):
        read_measurements(own)


@pytest.mark.parametrize(
    ("both_rates", "lost", "kept", "said"),
    [
        (
            True,
            slice(2, 4),
            62,
            "2 of 64 turns left out: no rest after the turn at 10 deg/s in line 3 (state 1, tilt 0 deg) and "
            "no rest before the turn at -10 deg/s in line 4 (state 1, tilt 0 deg)",
        ),
        (
            False,
            slice(0, 1),
            30,
            "2 of 32 turns left out: no rest before the turn at 10 deg/s in line 2 (state 1, tilt 0 deg); "
            "with it 1 turn of that state and tilt the other way",
        ),
    ],
)
def test_turns_without_a_rest_are_left_out_and_the_others_tell_the_same(
    tmp_path: Path, both_rates: bool, lost: slice, kept: int, said: str
) -> None:
    """By the known answer; what is left of a tilt may turn one way only, and goes too."""
    rows = lines(rate_on_rests=False)
    if not both_rates:
        rows = [row for i in range(0, len(rows), 3) for row in rows[i : i + 3] if i % 12 < 6]
    del rows[lost]
    found = decouple(turns := read_measurements(written(tmp_path, rows)))
    assert len(turns.output) == kept and found.notes[0] == said
    np.testing.assert_allclose(found.K, 1.2345, rtol=1e-9)
    assert (found.delta_x_deg, found.delta_y_deg) == pytest.approx((5.0, 3.0), abs=1e-8)


def test_a_lost_rest_is_named_where_the_others_do_not_determine_the_result(tmp_path: Path) -> None:
    rows = [row for row in lines(rate_on_rests=False) if row.split(",")[1] in ("0", "90")]
    del rows[2:4], rows[6:8]
    with pytest.raises(InputError, match=r"no rest after the turn at 10 deg/s in line 3 .* do not tell"):
        read_measurements(written(tmp_path, rows))


def test_no_turn_at_all(tmp_path: Path) -> None:
    rest = [row for row in lines() if ",turn," not in row]
    with pytest.raises(InputError, match="no turn"):
        read_measurements(written(tmp_path, rest))


def test_short_rests_of_which_rows_are_lost_are_used_or_told_with_the_reason(monkeypatch):
    """Rests of 14 s at 1 Hz, 40 % of rows lost: of a table that steps at once, and of slower ones."""

    def lossy(acceleration: float, seed: int, rest_s: int = 14) -> TableMeasurements:
        monkeypatch.setattr(simulated, "REST_S", rest_s)
        monkeypatch.setattr(simulated, "ACCELERATION", acceleration)
        rows, time, _ = simulated.recorded(simulated.CASES["tactical"], np.random.default_rng([3, seed]))
        kept = np.random.default_rng(seed).random(len(time)) >= 0.4
        columns = {name: getattr(rows, name)[kept] for name in ("state", "tilt_deg", "rate_deg_s", "output")}
        return from_samples(replace(rows, **columns), time[kept])

    assert len(lossy(100.0, 6).output) == 4 * 4 * 6
    some = lossy(10.0, 0)
    assert len(some.output) == 94 and some.notes[0].startswith("2 of 96 turns left out: no rest after")
    found = decouple(some)
    true = simulated.recorded(simulated.CASES["tactical"], np.random.default_rng([3, 0]))[2]["K"]
    assert found.se is not None and abs(found.K - true) < 3.0 * float(str(found.se["K"]))
    with pytest.raises(InputError, match=r"of which 8 samples of about 11 are recorded.*lose fewer samples"):
        lossy(100.0, 0, rest_s=12)


def test_samples_that_stand_out_are_told_where_they_count():
    """A spike of 1000 deg/h in a turn looked like a fixture tilted across; one in a way is cut with it."""
    rows, time, _ = simulated.recorded(simulated.CASES["tactical"], np.random.default_rng([3, 0]))
    turning = np.flatnonzero(rows.rate_deg_s == 100.0)
    for row, told in ((turning[36], True), (turning[0] - 1, False)):
        output = rows.output.copy()
        output[row] += 1000.0
        notes = from_samples(replace(rows, output=output), time).notes
        assert [f"in {rows.row_name(row)}; they count" in note for note in notes] == [True] * told
