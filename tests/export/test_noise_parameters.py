"""Noise terms in other programs' units: by what each term means, and Q by Van Loan's matrix exponential."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
import yaml
from scipy.linalg import expm

from fogml.errors import InputError
from fogml.export.noise_parameters import noise_parameters, noise_text, process_noise

N, B, K = 0.01, 0.02, 0.3


def noise(**more) -> dict:
    terms = {
        "N": {"value": N, "ci": [0.9 * N, 1.1 * N]},
        "B": {"value": B, "ci": [0.9 * B, 1.1 * B]},
        "K": {"value": K, "ci": [0.9 * K, 1.1 * K]},
    }
    return {"run": "static.csv", "sample_s": 0.01, "terms": terms | more}


def test_densities_are_what_the_terms_mean():
    found = noise_parameters(noise())
    # White rate of that density makes an angle of N degrees in an hour, the walk a rate of K deg/h.
    assert np.degrees(found.white * np.sqrt(3600.0)) == pytest.approx(N)
    assert np.degrees(found.walk * np.sqrt(3600.0)) * 3600.0 == pytest.approx(K)
    assert np.degrees(found.instability) * 3600.0 == pytest.approx(B)


@pytest.mark.parametrize("interval_s", [0.01, 1.0, 300.0])
def test_q_is_that_of_the_matrix_exponential(interval_s):
    white, walk = 2e-6, 3e-8
    F, G = np.array([[0.0, 1.0], [0.0, 0.0]]), np.diag([white**2, walk**2])
    big = expm(np.block([[-F, G], [np.zeros((2, 2)), F.T]]) * interval_s)
    np.testing.assert_allclose(process_noise(white, walk, interval_s), big[2:, 2:].T @ big[:2, 2:], rtol=1e-9)


@pytest.mark.parametrize("to", ["kalibr", "matlab"])
def test_a_name_of_two_lines_stays_a_comment(to):
    plain, odd = (noise_text(noise() | {"run": run}, to)[1] for run in ("a", "a\nupdate_rate: 1\n"))
    assert odd.splitlines()[1:] == plain.splitlines()[1:]


def test_each_program_reads_its_file():
    found = noise_parameters(noise())
    name, text = noise_text(noise(), "kalibr")
    values = yaml.safe_load(text)
    assert name.endswith(".yaml") and values["update_rate"] == 100.0
    assert values["gyroscope_noise_density"] == pytest.approx(found.white)
    assert values["gyroscope_random_walk"] == pytest.approx(found.walk)
    name, text = noise_text(noise(), "matlab")
    pairs = dict(re.findall(r"'(\w+)', ([\d.e+-]+)", text))
    assert float(pairs["NoiseDensity"]) == pytest.approx(found.white)
    assert float(pairs["RandomWalk"]) == pytest.approx(found.walk)
    assert float(pairs["BiasInstability"]) == pytest.approx(found.instability)
    assert text.count("(") == text.count(")") and name.removesuffix(".m").isidentifier()
    values = json.loads(noise_text(noise(), "kalman")[1])
    assert values["Q"] == process_noise(found.white, found.walk, 0.01)
    assert values["R"] == pytest.approx(found.white**2 * 100.0)


def test_a_term_not_told_stands_with_its_upper_end_or_is_asked_for():
    bounded = noise(K={"value": None, "ci": [0.0, 2.0 * K]})
    assert noise_parameters(bounded).walk == pytest.approx(2.0 * noise_parameters(noise()).walk)
    assert "K: upper end" in noise_text(bounded, "kalibr")[1]
    moving = noise(K={"value": None, "ci": [None, None], "reason": "the temperature moves"})
    with pytest.raises(InputError, match=r"no rate random walk \(the temperature moves\)"):
        noise_text(moving, "matlab")
    with pytest.raises(InputError, match="known are kalibr, matlab, kalman"):
        noise_text(noise(), "gtsam")
