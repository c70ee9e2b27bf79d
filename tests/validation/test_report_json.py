"""``report.json`` has the keys that other programs read, and holds nothing that JSON does not."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.json_files import finite_json, json_text
from fogml.runs.run import Run
from fogml.validation.compare import Comparison
from fogml.validation.judge import judge
from fogml.validation.report_json import comparison_json, judgement_json
from tests.validation.known_drift import KnownDrift


@pytest.fixture(scope="module")
def judgement():
    rng = np.random.default_rng(0)
    time = np.arange(2000.0)
    runs = [
        Run.from_columns(name, time=time, gyro=rng.normal(size=2000), T=20 + time / 100)
        for name in ("a.csv", "b.csv")
    ]
    model = KnownDrift().fit(runs[0])
    return judge(model, runs[0], runs[1], design_index=0.5, limits={"bias_stability": 0.01})


def test_keys(judgement):
    values = json.loads(json.dumps(judgement_json(judgement), allow_nan=False))
    assert values["schema"] == "fogml.train/1"
    assert {"kind", "features", "parameters", "bytes"} <= set(values["model"])
    assert [run["run"] for run in values["train"]] == ["a.csv"]
    (run,) = values["test"]
    assert (run["run"], run["unit"], run["averaging_s"]) == ("b.csv", "deg/h", 100)
    assert {"bias", "bias_stability", "range", "rms"} <= set(run["before"])
    assert set(run["before"]) == set(run["after"])
    assert {"floor", "outside_training"} <= set(run)
    assert set(values["design_index"]) == {"limit", "value", "met"}
    assert [set(limit) for limit in values["limits"]] == [{"quantity", "limit", "value", "met"}]
    assert values["design_index"]["met"] is True
    assert values["limits"][0]["met"] is False


def test_what_is_left_by_regime_adds_up_to_what_is_left(judgement):
    (run,) = judgement_json(judgement)["test"]
    parts = run["rms_by_regime"].values()
    assert sum(part["share"] for part in parts) == pytest.approx(1.0)
    for when in ("before", "after"):
        squares = sum(part["share"] * part[when] ** 2 for part in parts)
        assert squares == pytest.approx(run[when]["rms"] ** 2)


def test_no_design_index_no_key(judgement):
    from dataclasses import replace

    assert "design_index" not in judgement_json(replace(judgement, design_index=None))


def test_comparison_keys(judgement):
    values = comparison_json(Comparison({"M1": judgement}, {"joint": "no turns"}))
    assert values["schema"] == "fogml.compare/1"
    assert values["failed"] == {"joint": "no turns"}
    single = judgement_json(judgement)
    single.pop("schema")
    assert values["models"]["M1"] == single


def test_numpy_and_numbers_that_json_lacks():
    values = finite_json(
        {"a": np.float64(1.5), "b": np.arange(2), "c": (float("nan"), 1.0), "d": np.bool_(True)}
    )
    assert values == {"a": 1.5, "b": [0, 1], "c": [None, 1.0], "d": True}
    assert type(values["d"]) is bool
    with pytest.raises(InputError, match=r"'test\[0\]\.after\.rms' comes out as inf"):
        finite_json({"test": [{"after": {"rms": np.inf}}]})
    with pytest.raises(InputError, match=r"report\.json: 'a' comes out as nan"):
        json_text({"a": float("nan")}, "report.json")
