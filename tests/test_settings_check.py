"""Settings of Python callers: each number that can't be is refused where it is set, by its name."""

from __future__ import annotations

import math
from dataclasses import MISSING, fields, replace
from typing import Any

import numpy as np
import pytest

from fogml.benchmark.make import make_round
from fogml.blind.make import make_cases
from fogml.errors import InputError
from fogml.fleet.engines import run_tasks
from fogml.gap.diagnosis import diagnose
from fogml.gap.planning.lab import Lab
from fogml.gap.planning.next_run import RepeatSettings
from fogml.gap.planning.plan import plan_runs
from fogml.gap.settings import Grids, Priors
from fogml.gap.step_settings import NoiseSettings, Reported, RowSettings, SearchSettings
from fogml.lab.rate_tests import Criteria
from fogml.models.auto import AutoModel
from fogml.models.names import make_model
from fogml.models.size_priors import SizePriors
from fogml.monitor.evidence import ChangePrior
from fogml.runs.shipped import shipped_run
from fogml.runs.thermometers import LimitSettings
from fogml.signals.noise_spectrum import Resolution
from fogml.twin.draws import draw_units, drawn_twin
from fogml.twin.plant.fit import FitSettings
from fogml.twin.simulate import simulate
from fogml.twin.twin_file import load_twin

KINDS = (
    *(Priors, RowSettings, NoiseSettings, SearchSettings, Reported, Grids, RepeatSettings),
    *(SizePriors, ChangePrior, LimitSettings, Resolution, FitSettings, Criteria, Lab),
)


@pytest.mark.parametrize("kind", KINDS)
def test_no_number_is_nan_infinite_text_or_a_flag(kind: Any) -> None:
    settings = kind()
    checked = 0
    for entry in fields(kind):
        several = isinstance(entry.default, tuple)
        like = entry.default[0] if several else entry.default
        if entry.default is MISSING or isinstance(like, str | bool):
            continue
        checked += 1
        for wrong in (math.nan, math.inf, "1", True, None):
            value = (wrong, *entry.default[1:]) if several else wrong
            with pytest.raises(InputError, match=f"{kind.__name__}: '{entry.name}' is"):
                replace(settings, **{entry.name: value})
        if several:
            with pytest.raises(InputError, match=r"numbers .* are needed"):
                replace(settings, **{entry.name: ()})
    assert checked


@pytest.mark.parametrize(
    "kind, wrong, message",
    [
        (Priors, {"sizes": 1}, "a whole number above 1"),
        (Priors, {"sizes": 2.5}, "a whole number above 1"),
        (Priors, {"beyond_range": 1.0}, "above 1"),
        (Priors, {"unknown": 0.0}, "between 0 and 1"),
        (Priors, {"greatest_size": 3.0}, "'greatest_size' is above 'least_size'"),
        (RowSettings, {"least_full": 1.1}, "at most 1"),
        (NoiseSettings, {"white_steps": (1.0, 1.06)}, "some numbers above 1"),
        (Grids, {"grid_nodes": (9, 5)}, "3 whole numbers above 0"),
        (Grids, {"periods_degc": (40.0, 1.5)}, "the first is the lower one"),
        (ChangePrior, {"sizes": (0.0, 1.0)}, "some numbers above 0"),
        (SizePriors, {"spread": 0.0}, "a number above 0"),
    ],
)
def test_what_a_formula_can_not_take_is_refused(kind: Any, wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        kind(**wrong)


def test_what_a_formula_can_take_is_taken() -> None:
    assert Priors(sizes=2, slow_noise=(-1.0,)).lengths.tolist() == pytest.approx([3.0, 60.0])
    assert RowSettings(least_full=1).least_full == 1
    assert ChangePrior().steady().wander == (0.0,)


SEEDS_THAT_ARE_NONE = ("x", -1, 1.5, 2.0, True, np.True_, None, math.nan)
BY_SEED = {
    "model": lambda seed: make_model("auto", seed=seed),
    "model without chance": lambda seed: make_model("polynomial", seed=seed),
    "network": lambda seed: make_model("rbf", seed=seed),
    "automatic choice": lambda seed: AutoModel(seed=seed).fit([shipped_run("thermal-cycle-2-y")]),
    "simulation": lambda seed: simulate("multi-point-cycle", "tactical", sample_s=3600.0, seed=seed),
    "units": lambda seed: draw_units(load_twin("tactical"), 1, seed=seed),
    "drawn twin": lambda seed: drawn_twin(load_twin("tactical"), seed, 0),
    "diagnosis": lambda seed: diagnose("tactical", [], seed=seed),
    "plan": lambda seed: plan_runs(load_twin("tactical"), ["k1"], seed=seed),
    "cases": lambda seed: make_cases("nowhere", 1, seed),
    "round": lambda seed: make_round("nowhere", seed=seed),
}


@pytest.mark.parametrize("seed", SEEDS_THAT_ARE_NONE)
@pytest.mark.parametrize("what", BY_SEED)
def test_a_seed_that_is_none_is_told_alike_everywhere_before_anything_is_done(what: str, seed: Any) -> None:
    with pytest.raises(InputError) as told:
        BY_SEED[what](seed)
    assert str(told.value).startswith(f"'seed' is {seed!r}; a whole number ")


@pytest.mark.parametrize("count", ["x", 0, -1, 1.5, True, None])
def test_a_count_that_is_none_is_told(count: Any) -> None:
    for call in (
        lambda: run_tasks([], workers=count),
        lambda: draw_units(load_twin("tactical"), count),
        lambda: make_cases("nowhere", count, 0),
    ):
        with pytest.raises(InputError, match="a whole number of 1 or above is needed"):
            call()


def test_numpys_integers_are_seeds_and_counts() -> None:
    for kind in (np.int64, np.uint8):
        assert len(draw_units(load_twin("tactical"), kind(1), seed=kind(3))) == 1
        assert run_tasks([], workers=kind(1)) == []
        assert make_model("rbf", seed=kind(3)).regressor.seed == 3
