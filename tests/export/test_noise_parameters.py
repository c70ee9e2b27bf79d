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
        "Q": {"value": None, "ci": [0.0, 0.1]},
        "N": {"value": N, "ci": [0.9 * N, 1.1 * N]},
        "B": {"value": B, "ci": [0.9 * B, 1.1 * B]},
        "K": {"value": K, "ci": [0.9 * K, 1.1 * K]},
    }
    return {"run": "static.csv", "sample_s": 0.01, "span_s": 36000.0, "terms": terms | more}


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


def told_allan_variance(held: dict, doublings: int) -> tuple[float, float]:
    """Averaging time [s] and Allan variance [(rad/s)^2] of the angle that a file's transition and Q make."""
    model = held["with_B"]
    phi, q = np.array(model["transition"]), np.array(model["Q"])
    for _ in range(doublings):
        phi, q = phi @ phi, phi @ q @ phi.T + q
    tau = held["interval_s"] * 2.0**doublings
    one = np.eye(len(phi))
    start = np.diag([0.0, 0.0, *model["variance_at_start"]])
    # angle(2 tau) - 2 angle(tau) + angle(0), of the start and the noise of either step
    parts = [(phi @ phi - 2.0 * phi + one, start), (phi - 2.0 * one, q), (one, q)]
    return tau, sum(row[0] @ p @ row[0] for row, p in parts) / (2.0 * tau**2)


@pytest.mark.parametrize("interval_s", [0.001, 1.0, 100.0])
@pytest.mark.parametrize("b", [0.02, 0.3])
def test_with_bias_instability_the_states_have_the_gyros_allan_deviation(interval_s, b):
    B = {"value": b, "ci": [0.9 * b, 1.1 * b]}
    held = json.loads(noise_text(noise(B=B) | {"sample_s": interval_s}, "kalman")[1])
    assert len(held["with_B"]["state"]) < 13
    for doublings in range(int(np.log2(18000.0 / interval_s)) + 1):
        tau, variance = told_allan_variance(held, doublings)
        hours = tau / 3600.0
        wanted = N**2 / hours + 2.0 * np.log(2.0) / np.pi * b**2 + K**2 * hours / 3.0
        assert np.degrees(np.sqrt(variance)) * 3600.0 == pytest.approx(np.sqrt(wanted), rel=0.05)


def test_what_holds_no_bias_instability_says_so():
    assert "Neither holds the bias instability" in noise_text(noise(), "kalibr")[1]
    none = noise(B={"value": None, "ci": [0.0, 1.0]})
    assert "instability" not in noise_text(none, "kalibr")[1]
    assert "with_B" not in json.loads(noise_text(none, "kalman")[1])


def test_a_samples_variance_holds_quantisation():
    rng, q, interval = np.random.default_rng(0), 2e-6, 0.01
    held = json.loads(noise_text(noise(Q={"value": 1e6 * q, "ci": [1.0, 3.0]}), "kalman")[1])
    angle = q * np.sqrt(12.0) * rng.uniform(-0.5, 0.5, 200001)
    white = np.radians(N) / 60.0 / np.sqrt(interval) * rng.standard_normal(200000)
    assert held["R"] == pytest.approx(np.var(np.diff(angle) / interval + white), rel=0.01)


@pytest.mark.parametrize("how", [{"hold": {"samples": 10.0}}, {"filter": {"kind": "butterworth"}}, {}])
def test_samples_that_go_together_are_told(how):
    held = json.loads(noise_text(noise() | {"hold": None, "filter": None} | how, "kalman")[1])
    assert ("R_note" in held) == bool(how)
