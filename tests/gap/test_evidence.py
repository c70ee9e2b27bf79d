"""Evidence of sets against dense normal densities, and against integrals over one amplitude."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal

from fogml.gap.basis import build_basis
from fogml.gap.dictionary import unknown_groups
from fogml.gap.evidence import Field, Term
from fogml.gap.group_gains import group_gains
from fogml.gap.model import EffectValue
from fogml.gap.priors import LENGTHS
from fogml.gap.slack import slack_columns
from tests.gap.small_model import SmallModel, framed, noise_of, ramps, recorded

MODEL = SmallModel(("bend", "cube", "mixture"))


@pytest.fixture(scope="module")
def field() -> Field:
    rng = np.random.default_rng(5)
    runs = []
    for name, turns, count in (("a", 2, 120), ("b", 3, 90)):
        run = ramps(name, count=count, turns=turns)
        bend = EffectValue("bend", 1.5, {"centre_temperature": 18.0, "width": 6.0})
        runs.append(recorded(run, MODEL, {"offset": 1.0, "slope": -0.5}, (bend,), noise_of(run, rng)))
    frame = framed(runs, MODEL)
    return Field(build_basis(frame, MODEL.candidates(), unknown_groups(frame.observations), MODEL.grade))


def dense_log_density(field: Field, terms) -> float:
    """Log density of the whitened data: unit noise, constants and terms as normal columns."""
    rows = field.basis.rows
    covariance = np.eye(len(rows)) + rows[:, field.basis.constants] @ rows[:, field.basis.constants].T
    for columns, length in terms:
        covariance += length**2 * columns @ columns.T
    return float(multivariate_normal(np.zeros(len(rows)), covariance).logpdf(rows[:, 0]))


def node_of(field: Field, id: str) -> int:
    return next(i for i, n in enumerate(field.basis.nodes) if n.candidate == id)


def test_evidence_of_a_set_is_the_dense_normal_density(field):
    rows, empty = field.basis.rows, dense_log_density(field, [])
    zero = field.condition([]).log_evidence
    group = next(iter(field.basis.groups))
    nodes = [field.basis.nodes[node_of(field, id)] for id in ("bend", "cube")]
    unknown = tuple(int(c) for c in field.basis.groups[group])
    for sets in ([0], [0, 1], [0, 1, "unknown"]):
        chosen = [(nodes[i].columns, 10.0 * (i + 1)) if i != "unknown" else (unknown, 20.0) for i in sets]
        told = field.condition([Term(*c) for c in chosen]).log_evidence - zero
        expected = dense_log_density(field, [(rows[:, list(c)], length) for c, length in chosen]) - empty
        assert told == pytest.approx(expected, abs=1e-6)


def test_gains_of_nodes_are_differences_of_evidence(field):
    held = [Term(field.basis.nodes[node_of(field, "mixture")].columns, 10.0)]
    before = field.condition(held)
    gains = before.node_gains()
    checked = 0
    for i, node in enumerate(field.basis.nodes):
        if node.candidate != "bend" or i % 5:
            continue
        for j in (0, 3, 6):
            after = field.condition([*held, Term(node.columns, float(LENGTHS[j]))])
            expected = after.log_evidence - before.log_evidence + field.log_weights[i, j]
            assert gains[i, j] == pytest.approx(expected, abs=1e-7)
            checked += 1
    assert checked >= 6


def test_an_amplitude_of_one_sign_is_integrated_over_that_sign_alone(field):
    place = node_of(field, "cube")
    node = field.basis.nodes[place]
    gains = field.condition([]).node_gains()
    fit, size = field.gram[node.columns[0], 0], field.gram[node.columns[0], node.columns[0]]
    for j in (0, 2):
        length = float(LENGTHS[j])

        def density(a, length=length):
            prior = 2.0 * np.exp(-0.5 * (a / length) ** 2) / (np.sqrt(2.0 * np.pi) * length)
            return prior * np.exp(a * fit - 0.5 * a**2 * size)

        middle = max(fit / size, 0.0)
        integral = quad(density, 0.0, middle + 12.0 / np.sqrt(size), limit=200)[0]
        assert gains[place, j] - field.log_weights[place, j] == pytest.approx(np.log(integral), abs=1e-5)


def test_coefficients_are_those_of_the_joint_posterior(field):
    rows = field.basis.rows
    node = field.basis.nodes[node_of(field, "bend")]
    mean, covariance = field.condition([Term(node.columns, 40.0)]).coefficients()
    fixed = rows[:, field.basis.constants]
    every = np.concatenate([fixed, rows[:, list(node.columns)]], axis=1)
    prior = np.concatenate([np.ones(fixed.shape[1]), np.full(len(node.columns), 40.0**-2)])
    joint = np.linalg.inv(every.T @ every + np.diag(prior))
    own = slice(fixed.shape[1], None)
    np.testing.assert_allclose(mean, (joint @ every.T @ rows[:, 0])[own], rtol=1e-6)
    np.testing.assert_allclose(covariance, joint[own, own], rtol=1e-5, atol=1e-9)


def test_groups_of_the_unknown_gain_what_their_evidence_gains(field):
    held = field.condition([Term(field.basis.nodes[0].columns, 20.0)])
    for name, columns in field.basis.groups.items():
        gains = group_gains(held, [name])[0]
        for j in (1, 4):
            after = field.condition(
                [*held.terms, Term(tuple(int(c) for c in columns), float(LENGTHS[j]))]
            ).log_evidence
            assert gains[j] == pytest.approx(after - held.log_evidence, abs=1e-7)


def test_room_for_an_effects_form_is_appended_as_if_it_had_been_there(field):
    place = node_of(field, "bend")
    columns = field.slack(place)
    assert columns and field.slack(place) == columns
    slack = slack_columns(field.basis, place)
    assert slack.shape[1] == len(columns)
    own = field.basis.rows[:, list(field.basis.nodes[place].columns)]
    assert np.abs(own.T @ slack).max() < 1e-6 * np.linalg.norm(slack)
    every = np.concatenate([field.basis.rows, slack], axis=1)
    fixed = every[:, field.basis.constants]
    inverse = np.linalg.inv(np.eye(fixed.shape[1]) + fixed.T @ fixed)
    expected = every.T @ every - every.T @ fixed @ inverse @ fixed.T @ every
    before = [0, *field.basis.nodes[place].columns]
    chosen, placed = [*before, *columns], [*before, *range(-len(columns), 0)]
    found = field.gram[np.ix_(chosen, chosen)]
    np.testing.assert_allclose(found, expected[np.ix_(placed, placed)], rtol=1e-6, atol=1e-6)
    assert np.trace(field.gram[np.ix_(columns, columns)]) == pytest.approx(1.0, rel=0.2)
    # The evidence of a set with room for the form is again that of the dense density.
    terms = [(own, 20.0), (slack, 4.0)]
    told = (
        field.condition([Term(field.basis.nodes[place].columns, 20.0), Term(columns, 4.0)]).log_evidence
        - field.condition([]).log_evidence
    )
    assert told == pytest.approx(dense_log_density(field, terms) - dense_log_density(field, []), abs=1e-6)
