"""The benchmarks' peers, studies and pages are right; their figures are not tested here."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from experiments.benchmarks import accuracy, all_rows, diagnosis, limits, scale, training  # noqa: E402
from experiments.benchmarks.accuracy_cases import Case, cold_start, thermal_cycle, twin_runs  # noqa: E402
from experiments.benchmarks.harness import Ran  # noqa: E402
from experiments.benchmarks.jobs import JOBS, STUDIES  # noqa: E402
from experiments.benchmarks.needs import needs  # noqa: E402
from experiments.benchmarks.pages import results_page  # noqa: E402
from experiments.benchmarks.peer_model import Budget, PeerModel, tuned  # noqa: E402
from experiments.benchmarks.peers import PEERS, Peer, RowLearner, peer_of  # noqa: E402
from experiments.benchmarks.study import carried_out  # noqa: E402
from fogml.models.names import make_model  # noqa: E402
from fogml.models.table import TrainingTable  # noqa: E402
from fogml.runs.run import Run  # noqa: E402

SMALL = Budget(settings=2, folds=2, most_rows=300)


def table(count: int = 400) -> TrainingTable:
    """A smooth function of three inputs along time."""
    time = np.linspace(0.0, 4000.0, count)
    t = 20.0 * np.sin(time / 700.0)
    rate = np.gradient(t, time) * 60.0
    X = np.column_stack((t, rate, t * rate))
    y = 0.5 + 0.02 * t + 0.3 * np.tanh(t / 10.0) + 0.1 * rate
    index = np.zeros(count, dtype=np.intp)
    return TrainingTable(X, y, index, time, np.arange(count) * 20 // count)


def drifting_run(seed: int = 0) -> Run:
    time = np.arange(2000.0) * 2.0
    t = 10.0 + 15.0 * np.sin(time / 500.0)
    noise = 0.01 * np.random.default_rng(seed).standard_normal(len(time))
    return Run("made", {"time": time, "gyro": 1.0 + 0.05 * t + noise, "T": t})


@pytest.mark.parametrize("peer", [peer for peer in PEERS if peer.name != "cubic"], ids=lambda peer: peer.name)
def test_each_peer_learns_a_smooth_drift(peer: Peer):
    rows = table(160)
    # A recurrent network takes a second a fit.
    budget = Budget(settings=1, folds=2) if peer.name == "gru" else SMALL
    learner, setting = tuned(peer, rows, budget)
    assert setting in peer.settings(budget.settings)
    left = learner.at_rows(rows, np.arange(len(rows))) - rows.y
    assert np.sqrt(np.mean(left**2)) < 0.5 * rows.y.std()
    along = learner.along(rows.X, rows.time_s)
    assert along.shape == rows.y.shape
    assert np.sqrt(np.mean((along - rows.y) ** 2)) < 0.5 * rows.y.std()


def test_same_seed_same_network():
    rows, peer = table(120), peer_of("gru")
    first, second = (tuned(peer, rows, Budget(1, 2))[0].along(rows.X, rows.time_s) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_cubic_is_a_polynomial_fit():
    run = drifting_run()
    model = PeerModel(peer_of("cubic"), SMALL).fit(run)
    assert model.rows_ <= SMALL.most_rows
    expected = np.polynomial.Polynomial.fit(run.columns["T"], run.gyro, 3)(run.columns["T"])
    np.testing.assert_allclose(model.predict(run), expected, atol=0.01)


def test_setting_is_chosen_on_folds_of_time():
    seen: list[tuple[float, int]] = []

    class Constant:
        def __init__(self, value: float) -> None:
            self.value = value

        def fit(self, X: np.ndarray, y: np.ndarray) -> None:
            seen.append((self.value, len(y)))

        def predict(self, X: np.ndarray) -> np.ndarray:
            # Standardised targets: the right constant is 0.
            return np.full(len(X), self.value)

    peer = Peer(
        "made", "made", lambda s, seed: RowLearner(Constant(s["value"])), {"value": ("of", (2.0, 0.0))}
    )
    rows = table()
    learner, setting = tuned(peer, rows, Budget(settings=6, folds=4))
    assert setting == {"value": 0.0}
    # Six settings on four folds, none fitted to all rows, then the best on all.
    assert len(seen) == 25 and all(count < len(rows) for _, count in seen[:-1])
    assert seen[-1] == (0.0, len(rows))
    np.testing.assert_allclose(learner.at_rows(rows, np.arange(5)), rows.y.mean())


def test_settings_lie_in_their_ranges_and_repeat():
    peer = peer_of("svr")
    found = peer.settings(16)
    assert found == peer.settings(16) and found[:4] == peer.settings(4)
    for name, (_, low, high) in peer.ranges.items():
        values = np.array([setting[name] for setting in found])
        assert low <= values.min() < np.sqrt(low * high) < values.max() <= high
    assert peer_of("gaussian-process").settings(16) == [{}]


def test_figures_over_the_floor_of_a_perfect_model():
    """A model that gives the truth leaves the noise itself."""
    run = drifting_run(seed=1)
    noise = run.gyro - (1.0 + 0.05 * run.columns["T"])
    train = drifting_run(seed=2)
    model = make_model("polynomial", features="T").fit(train)
    case = Case("made", {"test": "b"}, (train,), run, 100.0, noise)
    (row,) = accuracy.judged(case, {"polynomial": model})
    assert row["floor"] == pytest.approx(0.01 / np.sqrt(50), rel=0.4)
    assert accuracy.over_floor(row) == pytest.approx(1.0, rel=0.05)
    assert row["error"] < 0.2 * row["floor"]


def test_cases_hold_out_what_they_say():
    (cycle,) = thermal_cycle(quick=True)
    assert cycle.train[0].name != cycle.test.name
    (cold,) = cold_start(quick=True)
    assert len(cold.train) == 2
    assert cold.test.time[-1] < min(part.time[0] for part in cold.train)
    slower, faster = twin_runs(quick=True)
    assert slower.test.span_s > slower.train[0].span_s > faster.test.span_s
    assert slower.noise is not None and len(slower.noise) == len(slower.test)


def test_chambers_of_every_size_are_the_same_programme():
    coarse, fine = (training.training_run(1, (1.0,), count) for count in (2_000, 20_000))
    assert abs(len(coarse) - 2_000) <= 5 and abs(len(fine) - 20_000) <= 5
    areas = [trapezoid(run.columns["T_in"], run.time) for run in (coarse, fine)]
    assert areas[0] == pytest.approx(areas[1], rel=0.01)


def test_exponent_of_a_power_law():
    sizes = [1_000, 3_000, 10_000]
    slope, error = limits.exponent(sizes, [1e-3 * size**1.2 for size in sizes])
    assert slope == pytest.approx(1.2) and error < 1e-9


def test_ratios_of_training_are_of_the_same_turn():
    def row(model: str, turn: int, seconds: float, error: float) -> dict:
        return {
            "model": model, "rates": "one", "turn": turn, "seconds": seconds, "rows": 10,
            "before_mb": 100.0, "peak_mb": 150.0, "errors": {"slower": error, "faster": error},
        }  # fmt: skip

    rows = [row(training.OURS, 0, 1.0, 0.1), row(training.OURS, 1, 4.0, 0.1)]
    rows += [row("cubic", 0, 2.0, 0.2), row("cubic", 1, 12.0, 0.8)]
    ours, cubic = training.summary({"rows": rows})
    assert (ours["ratio"], cubic["ratio"]) == (1.0, 2.5)
    assert cubic["error_over_ours"] == pytest.approx(4.0) and cubic["added_mb"] == 50.0


def test_training_in_turn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    asked: list[list[str]] = []

    def here(words: list[str]) -> Ran:
        """The worker's work in this process."""
        asked.append(words[2:])
        model, samples, rates, unit, quick = words[2:]
        assert quick == "--quick"
        told = training.trained_alone(model, int(samples), rates, int(unit), training.QUICK)
        return Ran(json.dumps(told), 1.0, 0.0)

    monkeypatch.setattr(training, "run_python", here)
    found = training.measure("1e4", "one", True, 2, tmp_path)
    assert [words[0] for words in asked] == [training.OURS, "cubic", "cubic", training.OURS]
    assert [words[3] for words in asked] == ["500", "500", "501", "501"]
    assert found["rows"][1]["rows"] == training.QUICK.most_rows
    assert "| cubic | 150 |" in training.page(found)


def test_peers_on_more_rows(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """The page's figures by hand, from trainings that are stood in for."""

    def alone(arguments: list[str], **_: object) -> Ran:
        model, rows = (
            arguments[2],
            int(arguments[arguments.index("--rows") + 1]) if "--rows" in arguments else 9,
        )
        # KernelRidge in the square of its rows.
        told = {"rows": rows, "seconds": 0.5 if model == training.OURS else 1e-3 * rows**2}
        return Ran(json.dumps({**told, "errors": {"slower": 0.1, "faster": 0.2}}), 0.0, 0.0)

    monkeypatch.setattr(all_rows, "run_python", alone)
    found = all_rows.measure(True, 1, tmp_path)
    assert [row["rows"] for row in found["rows"]] == [9, 100, 150] * 2
    peers = found["rows"][1:3]
    seconds, exponent = all_rows.at_all_samples(peers, 2_000)
    assert exponent == pytest.approx(2.0) and seconds == pytest.approx(1e-3 * 2_000**2)
    assert all_rows.at_all_samples(peers, 155) == (pytest.approx(22.5), None)
    page = all_rows.page(found)
    assert "| kernel-ridge | 150 | 22.5 s | 45 | 0.1000 | 0.2000 |" in page
    assert "| kernel-ridge | all | | 8e+03; wanted 5: met | | |" in page


def test_a_peer_takes_the_rows_that_are_asked_for():
    told = training.trained_alone("kernel-ridge", 2_000, "one", 1, Budget(1, 2), 120)
    assert 100 < told["rows"] <= 120


@pytest.mark.parametrize("name", ["accuracy-twin", "compensation", "limits"])
def test_each_study_gives_its_section(name: str, tmp_path: Path):
    study = next(each for each in STUDIES if each.name == name)
    found = carried_out(study, tmp_path, quick=True, repeats=1)
    section = study.page(found)
    assert section.count("|---|") >= 1 and "nan" not in section


def test_diagnosis_section_tells_times_and_what_is_skipped():
    part = {"cases": 1, "seed": 1, "skipped": {"sbi": "sbi is not installed"}}
    part["rows"] = [{"method": "bic", "seconds": [2.0], "failed": [], "figures": {"one_top": 1.0}}]
    found = {"ten_hours": [8.0], "sizes": [10, 100], "seconds": [[1.0], [10.0]], "subset": part}
    text = diagnosis.page(found)
    assert "Skipped: sbi" in text and "1.00 ± 0.00" in text and "| bic | 1.00 | 2 |" in text


def test_other_ways_of_naming_answer_a_case(tmp_path: Path):
    if needs("pysindy")():
        pytest.skip("pysindy is not installed")
    found = diagnosis.subset(tmp_path / "blind", quick=True)
    assert {row["method"] for row in found["rows"]} >= {"stlsq", "pysindy"}
    assert all(row["failed"] == [] for row in found["rows"])


def results(studies: list[dict], jobs: list[dict]) -> dict:
    machine = {
        "date": "2026-01-01", "processor": "made", "cores": 1, "memory_gb": 1.0, "system": "made",
        "python": "3.11", "threads": "1", "versions": {},
    }  # fmt: skip
    common = {"command": "made", "machine": machine, "repeats": 5, "quick": False, "skipped": []}
    return {**common, "studies": studies, "jobs": jobs}


def test_scale_is_what_the_costs_add_up_to():
    rows = [
        {"name": "reading Parquet, 4 columns", "sizes": [1000], "seconds": [[1e-3]], "bytes": 50_000.0},
        {"name": "Allan deviation, 13 octaves", "sizes": [1000], "seconds": [[3e-3]], "bytes": 8_000.0},
    ]
    made = results([{"name": "limits", "rows": rows}], [])
    load = scale.Load(units=10, runs=2, rate_hz=1.0, hours=1.0)
    found, missing = scale.costs(made, load)
    # 7,200 samples at 1 and at 3 microseconds.
    assert {cost.name: round(cost.seconds, 9) for cost in found} == {
        "reading": 0.0072,
        "noise and Allan deviation": 0.0216,
    }
    assert any("diagnosis" in name for name in missing)
    # 50 bytes a sample, of them 32 in memory.
    assert scale.bytes_per_sample(made) == {"Parquet": 18.0}
    text = scale.scale_page(made, load)
    assert "| noise and Allan deviation | 0.0216 | 75% |" in text and "What breaks first" in text


def test_scale_without_figures_says_so():
    assert "Not measured" in scale.scale_page(results([], []))


def test_page_without_jobs_has_its_studies_and_peers():
    study = {"name": "limits", "title": "made", "machine_limits": {}, "rows": []}
    limit = limits.measure(True, 1, Path("."))
    text = results_page(results([{**study, **limit}], []))
    assert "## Made" in text and "| gaussian-process |" in text and "## Pairs" not in text


def test_names_are_told_apart():
    names = [each.name for each in (*JOBS, *STUDIES)]
    assert len(names) == len(set(names))


def test_what_is_not_installed_is_named():
    assert needs("numpy")() is None
    assert "no_such_package is not installed" in (needs("numpy", "no_such_package")() or "")


def test_own_rows_and_floors_take_the_place_of_those_of_the_same_cases():
    def row(model: str, axis: str, rms: float, floor: float = 0.1) -> dict:
        return {"group": "made", "axis": axis, "model": model, "floor": floor, "rms": rms}

    nothing, own, peer = accuracy.NOTHING, accuracy.OURS[0], "cubic"
    found = {"rows": [row(own, "x", 1.0), row(nothing, "x", 9.0), row(peer, "x", 2.0)], "budget": {}}
    again = [row(nothing, "x", 9.0, 0.2), row(own, "x", 4.0, 0.2)]
    new = accuracy.with_ours_again(found, again, "2026-11-22")
    assert [(each["rms"], each["floor"]) for each in new["rows"]] == [(4.0, 0.2), (9.0, 0.2), (2.0, 0.2)]
    assert new["ours_again"] == "2026-11-22" and found["rows"][0]["rms"] == 1.0
    # Other samples leave something else where no model is.
    for other in (again[1:], [row(nothing, "x", 8.0), again[1]]):
        with pytest.raises(ValueError, match="measure the whole study"):
            accuracy.with_ours_again(found, other, "2026-11-22")
