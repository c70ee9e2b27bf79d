"""The twin that a diagnosis writes, and averages of rows."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fogml.gap.model import EffectValue, NoisePrior, TwinModel
from fogml.gap.own_simulator import candidates_of
from fogml.gap.reports import _courses
from fogml.gap.where import averages
from fogml.twin.registry import effect
from fogml.twin.twin_file import load_twin, save_twin
from tests.report.diagnoses import diagnosis, hysteresis

TWIN = load_twin("nominal").with_nominal(b0=1.0, e0=100.0)
VALUES = {"b0": 1.0, "e0": 100.0}


def test_the_twin_that_is_written_has_what_was_found(tmp_path):
    values = (EffectValue("thermal_hysteresis", 0.2, {"half_width": 6.0}),)
    path = tmp_path / "twin.yaml"
    noise = NoisePrior(0.004, 0.02, 0.006, 1.1, 1.5, 2.0)
    save_twin(TwinModel(TWIN).diagnosed(VALUES, values, noise, {"b0": 0.01, "e0": 2.0}), path)
    again = TwinModel(load_twin(path))
    setting = again.twin.settings["thermal_hysteresis"]
    assert (setting.amplitude, dict(setting.shape)) == (0.2, {"half_width": 6.0})
    assert {c.name: (c.mean, c.sd) for c in again.constants}["b0"] == (1.0, 0.01)
    assert (again.noise.N, again.noise.factor_B) == pytest.approx((0.004, 1.5))
    assert "thermal_hysteresis" not in again.candidates()


def test_values_beyond_what_is_physical_are_written_within_it(tmp_path):
    path = tmp_path / "twin.yaml"
    wild = (EffectValue("thermal_hysteresis", 0.1, {"half_width": -3.0}),)
    save_twin(TwinModel(TWIN).diagnosed(VALUES, wild, NoisePrior(0.004, 0.02, 0.006), {}), path)
    assert load_twin(path).settings["thermal_hysteresis"].shape["half_width"] > 0.0


class Parted(SimpleNamespace):
    def __len__(self):
        return len(self.time_s)


def test_what_is_suspected_in_a_twin_is_as_likely_as_was_asked_for(tmp_path):
    """Of a diagnosis whose settings ask for more, less is kept."""
    twin = load_twin("nominal")
    found = diagnosis("unknown", suspected=(hysteresis(probability=0.1),))
    for least, kept in ((0.05, ["thermal_hysteresis"]), (0.2, [])):
        path = tmp_path / f"{least}.yaml"
        replace(found, least_suspected=least).write_model(TwinModel(twin), path)
        assert list(load_twin(path).suspected) == kept


def test_windows_keep_off_gaps_and_are_whole():
    kept = np.concatenate([np.arange(0, 103), np.arange(160, 400)])
    parted = Parted(time_s=20.0 * kept, row_s=20.0)
    windows = averages(parted)
    rows = np.where(parted.time_s < 3000.0, 0.0, 1.0)
    assert set(windows.of(rows)) == {0.0, 1.0}
    assert len(windows.time) == 103 // 5 + 240 // 5
    assert windows.window_s == 100.0
    coarse = averages(parted, averaging_s=5.0)
    assert coarse.window_s == 20.0 and len(coarse.time) == len(parted)


def test_what_the_twin_excludes_is_no_candidate():
    twin = load_twin("nominal").with_effect("shupe_winding", 1.0)
    assert "shupe_pure" in candidates_of(TwinModel(load_twin("nominal")))
    assert not {"shupe_pure"} & ({*candidates_of(TwinModel(twin))} | {*TwinModel(twin).candidates()})


def test_what_is_out_of_proportion_to_its_size_has_no_slider():
    """Half of what a dead zone makes is not what half a dead zone makes; it stays in what is replayed."""
    candidates = {id: effect(id) for id in ("deadband", "shupe_mohr", "thermal_hysteresis")}
    rows = SimpleNamespace(made=lambda declared, size, shape, values: size * np.ones(3))
    on = [(effect("deadband"), SimpleNamespace(amplitude=0.3, shape={}))]
    found = SimpleNamespace(
        scene=SimpleNamespace(candidates=candidates, runs=[rows], grade="tactical"),
        setting=SimpleNamespace(values={}),
        plant=SimpleNamespace(on=on),
    )
    after = SimpleNamespace(of_cause=lambda run, cause: 2.0 * np.ones(3))
    named = [SimpleNamespace(ids=("shupe_mohr",))]
    fit = SimpleNamespace(foretold=after, effects=[SimpleNamespace(id="shupe_mohr", amplitude=0.5)])
    courses = _courses(found, fit, named, 0)
    assert [(c.effect, c.acts) for c in courses] == [("shupe_mohr", True), ("thermal_hysteresis", False)]
