"""Repeatability over test runs: by its definition, and in everything that a judgement is written to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from openpyxl import load_workbook

from fogml.errors import InputError
from fogml.report.spreadsheet import spreadsheet
from fogml.report.train_page import train_page
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.validation.compare import compare
from fogml.validation.judge import judge
from fogml.validation.report_json import judgement_json
from tests.validation.known_drift import KnownDrift

pytestmark = pytest.mark.usefixtures("without_noise_terms")

BIASES = np.array([0.10, -0.04, 0.07, 0.01, 0.12, -0.02])
SCALE_PPM = np.array([30.0, 10.0, -20.0, 5.0, 0.0, 11.0])


def cycle(number: int, bias: float, scale_ppm: float = 0.0, powered_on: float | None = 0.0) -> Run:
    table = np.tile(np.repeat([0.0, 10.0, -10.0, 0.0], [300, 60, 60, 300]), 2)
    output = 3600.0 * table * (1.0 + 1e-6 * scale_ppm) + bias
    facts = Facts(unit="FOG-1", axis="x", powered_on=powered_on)
    time = np.arange(len(table), dtype=float)
    return Run.from_columns(
        f"cycle-{number}.csv", facts, time=time, gyro=output, rate=table, T=np.full(len(time), 25.0)
    )


def cycles(**facts) -> list[Run]:
    return [cycle(i, b, k, **facts) for i, (b, k) in enumerate(zip(BIASES, SCALE_PPM, strict=True))]


@pytest.fixture
def model() -> KnownDrift:
    return KnownDrift(lambda run: 0.5 * run.error_deg_h).fit(cycle(9, 0.0))


def test_spread_of_bias_and_scale_factor(model):
    found = judge(model, cycle(9, 0.0), cycles()).repeatability
    assert found is not None and found.runs == 6 and found.power_cycles
    assert found.bias.before == pytest.approx(np.std(BIASES, ddof=1), rel=1e-6)
    assert found.bias.after == pytest.approx(0.5 * np.std(BIASES, ddof=1), rel=1e-6)
    factors = 1.0 + 1e-6 * SCALE_PPM
    assert found.scale_factor is not None
    assert found.scale_factor.before == pytest.approx(
        1e6 * np.std(factors, ddof=1) / factors.mean(), rel=1e-6
    )
    assert not judge(model, cycle(9, 0.0), cycles(powered_on=None)).repeatability.power_cycles


def test_too_few_or_different_units_tell_nothing(model):
    runs = cycles()
    assert judge(model, cycle(9, 0.0), runs[:5]).repeatability is None
    other = replace(runs[0], facts=Facts(unit="FOG-2", axis="x"))
    assert judge(model, cycle(9, 0.0), [other, *runs[1:]], any_unit=True).repeatability is None
    still = runs[0].with_columns(rate=np.zeros(len(runs[0])), gyro=np.zeros(len(runs[0])))
    found = judge(model, cycle(9, 0.0), [still, *runs[1:]]).repeatability
    assert found is not None and found.scale_factor is None


def test_it_is_written_everywhere_and_may_be_limited(model, tmp_path):
    limits = {"bias_repeatability": 0.05, "scale_factor_repeatability": 1.0}
    judgement = judge(model, cycle(9, 0.0), cycles(), limits=limits)
    spread = 0.5 * float(np.std(BIASES, ddof=1))
    assert [outcome.met for outcome in judgement.limits] == [True, False]
    assert judgement.limits[0].value == pytest.approx(spread)
    values = judgement_json(judgement)["repeatability"]
    assert values["runs"] == 6 and values["over"] == "power cycles"
    assert values["bias"]["after"] == pytest.approx(spread)
    page = train_page(judgement)
    assert "Bias repeatability" in page and "over 6 power cycles" in page
    spreadsheet(judgement, tmp_path / "report.xlsx")
    cells = list(load_workbook(tmp_path / "report.xlsx")["Summary"].iter_rows(values_only=True))
    (row,) = [row for row in cells if row[0] == "Bias repeatability" and len(row) > 5 and row[5] is not None]
    # Chi-square of five degrees of freedom lies under 1.1455 and over 11.0705 with 5 % each, by tables.
    ends = [spread * np.sqrt(5.0 / quantile) for quantile in (11.0705, 1.1455)]
    assert row[2] == pytest.approx(spread) and row[4:6] == pytest.approx(ends, rel=1e-4)
    assert values["bias"]["after_ci90"] == pytest.approx(ends, rel=1e-4)


def test_a_limit_needs_enough_runs(model):
    with pytest.raises(InputError, match="6 test runs of one unit"):
        judge(model, cycle(9, 0.0), cycles()[:3], limits={"bias_repeatability": 0.05})


def test_left_out_runs_count_too():
    found = compare({"one": KnownDrift}, cycles(), None).judgements["one"].repeatability
    assert found is not None and found.runs == 6
