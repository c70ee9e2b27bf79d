"""Fits against a general least squares solver, scatter against standard errors, and where fits start."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from fogml.gap.fitting import fit_model
from fogml.gap.model import EffectValue
from fogml.gap.shapes import Node
from fogml.gap.starting import starting_values
from fogml.intervals import Z90
from tests.gap.small_model import MEANS, SmallModel, dense, framed, noise_of, ramps, recorded

MODEL = SmallModel()
TRUE = {"offset": 1.0, "slope": -0.5}
BEND = EffectValue("bend", 1.5, {"centre_temperature": 18.0, "width": 6.0})


def ready(seed, effects=(BEND,), turns=2, count=120):
    rng = np.random.default_rng(seed)
    run = ramps("a", count=count, turns=turns)
    return framed([recorded(run, MODEL, TRUE, effects, noise_of(run, rng))], MODEL)


def fitted(frame, effects):
    return fit_model(
        frame.observations, frame.whiteners, MODEL.constants, effects, MODEL.candidates(), MODEL.grade
    )


def node(shape, *more):
    return Node(dict(shape), (dict(shape), *({**shape, **other} for other in more)))


def test_a_fit_is_that_of_a_general_solver():
    frame = ready(1)
    first = EffectValue("bend", 1.0, {"centre_temperature": 20.0, "width": 5.0})
    fit = fitted(frame, [first])
    (o,) = frame.observations
    root = np.linalg.cholesky(dense(o.time, o.row_s))
    # Weak priors of shapes: their range is the central 90 % of a normal law about the start.
    spread = {"centre_temperature": 10.0 / Z90, "width": 4.5 / Z90}

    def residual(x):
        effect = EffectValue("bend", x[2], {"centre_temperature": x[3], "width": x[4]})
        left = o.recorded - o.model.output({"offset": x[0], "slope": x[1]}, (effect,))
        priors = [x[0] / 3.0, x[1] / 1.0]
        shapes = [(x[3] - 20.0) / spread["centre_temperature"], (x[4] - 5.0) / spread["width"]]
        return np.concatenate([np.linalg.solve(root, left), priors, shapes])

    solved = least_squares(residual, [0.0, 0.0, 1.0, 20.0, 5.0], method="lm", xtol=1e-14, ftol=1e-14)
    (effect,) = fit.effects
    found = [*fit.constants.values(), effect.amplitude, *effect.shape.values()]
    covariance = np.linalg.inv(solved.jac.T @ solved.jac)
    errors = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose((np.array(found) - solved.x) / errors, 0.0, atol=0.02)
    np.testing.assert_allclose(np.array(list(fit.standard_errors.values())) / errors, 1.0, atol=0.02)
    scaled = covariance / np.outer(errors, errors)
    np.testing.assert_allclose(fit.covariance / np.outer(errors, errors), scaled, atol=0.04)
    assert fit.names == ("offset", "slope", "bend.amplitude", "bend.centre_temperature", "bend.width")
    data = solved.fun[: len(o)]
    assert fit.square == pytest.approx(float(data @ data), rel=1e-4) and fit.rows == len(o)


def test_constants_alone_are_a_linear_posterior():
    frame = ready(2, effects=())
    fit = fit_model(frame.observations, frame.whiteners, MODEL.constants)
    fixed, y = frame.fixed, frame.residual[:, 0]
    joint = np.linalg.inv(fixed.T @ fixed + np.eye(2))
    sd = np.array([c.sd for c in MODEL.constants])
    np.testing.assert_allclose(list(fit.constants.values()), sd * (joint @ fixed.T @ y), rtol=1e-6)
    np.testing.assert_allclose(fit.covariance, joint * np.outer(sd, sd), rtol=1e-6)


def test_scatter_over_seeds_is_that_of_the_standard_errors():
    # So large that the weak priors of its shape say next to nothing.
    large = EffectValue("bend", 12.0, {"centre_temperature": 18.0, "width": 6.0})
    z = []
    for seed in range(60):
        rng = np.random.default_rng(100 + seed)
        true = {c.name: float(rng.normal(c.mean, c.sd)) for c in MODEL.constants}
        run = ramps("a", count=120)
        fit = fitted(framed([recorded(run, MODEL, true, (large,), noise_of(run, rng))], MODEL), [large])
        (effect,) = fit.effects
        errors = fit.standard_errors
        told = {
            **{name: (fit.constants[name], true[name]) for name in true},
            "bend.amplitude": (effect.amplitude, large.amplitude),
            **{f"bend.{name}": (effect.shape[name], large.shape[name]) for name in large.shape},
        }
        z.append([(value - true) / errors[name] for name, (value, true) in told.items()])
    z = np.array(z)
    # Of 60 fits the mean is known to 0.13 and the root mean square to 9 %.
    assert np.abs(z.mean(axis=0)).max() < 0.5
    assert ((z.std(axis=0) > 0.7) & (z.std(axis=0) < 1.3)).all(), z.std(axis=0)


def test_draws_scatter_as_the_covariance_says():
    fit = fitted(ready(3), [BEND])
    draws = fit.draws(np.random.default_rng(0), 4000)
    amplitudes = np.array([effects[0].amplitude for _, effects in draws])
    offsets = np.array([constants["offset"] for constants, _ in draws])
    errors = fit.standard_errors
    assert amplitudes.std() == pytest.approx(errors["bend.amplitude"], rel=0.05)
    assert offsets.mean() == pytest.approx(fit.constants["offset"], abs=4.0 * errors["offset"] / 60.0)
    place = (fit.names.index("offset"), fit.names.index("bend.amplitude"))
    assert np.cov(offsets, amplitudes)[0, 1] == pytest.approx(
        fit.covariance[place], abs=0.08 * errors["bend.amplitude"] * errors["offset"]
    )


def test_an_amplitude_that_no_output_hangs_on_has_no_error_and_stays():
    mute = EffectValue("mute", 2.0, {})
    model, frame = SmallModel(("bend", "mute")), ready(4)
    fit = fit_model(
        frame.observations, frame.whiteners, model.constants, [BEND, mute], model.candidates(), model.grade
    )
    without = fitted(frame, [BEND])
    assert fit.effects[1].amplitude == 2.0
    assert fit.standard_errors["mute.amplitude"] == 0.0
    others = [name for name in fit.names if name in without.names]
    np.testing.assert_allclose(
        [fit.standard_errors[name] for name in others],
        [without.standard_errors[name] for name in others],
        rtol=1e-6,
    )


def test_an_amplitude_stays_within_its_limits():
    frame = ready(4, effects=(EffectValue("cube", -2.0),))
    (effect,) = fitted(frame, [EffectValue("cube", 0.5)]).effects
    assert effect.amplitude == 0.0


def test_a_fit_starts_near_the_truth_whatever_the_angle():
    for phase in (20.0, 140.0, 265.0):
        line = EffectValue("line", 0.8, {"period": 900.0, "phase": phase})
        frame = ready(int(phase), effects=(BEND, line), count=200)
        start = starting_values(
            frame.observations,
            frame.whiteners,
            MODEL.constants,
            MEANS,
            [("bend", node(BEND.shape)), ("line", node({"period": 900.0, "phase": 0.0}))],
            MODEL.candidates(),
        )
        assert [e.id for e in start] == ["bend", "line"]
        assert 0.5 < start[0].amplitude < 3.0
        vector = start[1].amplitude * np.exp(1j * np.radians(start[1].shape["phase"]))
        assert abs(vector - 0.8 * np.exp(1j * np.radians(phase))) < 0.3
        fit = fitted(frame, start)
        found = {e.id: e for e in fit.effects}
        errors = fit.standard_errors
        assert abs(found["bend"].amplitude - 1.5) < 4.0 * errors["bend.amplitude"]
        vector = found["line"].amplitude * np.exp(1j * np.radians(found["line"].shape["phase"]))
        assert abs(vector - 0.8 * np.exp(1j * np.radians(phase))) < 0.1


def test_starting_values_are_the_joint_fit_where_everything_is_linear():
    cube, mixture = EffectValue("cube", 0.9), EffectValue("mixture", 0.6, {"share": 0.5})
    frame = ready(6, effects=(cube, mixture))
    (one,) = starting_values(
        frame.observations, frame.whiteners, MODEL.constants, MEANS, [("cube", node({}))], MODEL.candidates()
    )
    columns = np.concatenate([frame.fixed, frame.responses("cube", [{}])], axis=1)
    held = np.concatenate([columns, np.eye(2, 3)])
    target = np.concatenate([frame.residual[:, 0], np.zeros(2)])
    assert one.amplitude == pytest.approx(np.linalg.lstsq(held, target, rcond=None)[0][2], rel=1e-6)


def test_a_line_is_followed_to_its_frequency_over_many_cycles():
    # The range of periods is so wide that a hundredth of it is half a cycle over the run.
    line = EffectValue("line", 0.4, {"period": 403.0, "phase": 70.0})
    frame = ready(7, effects=(line,), count=400)
    fit = fitted(frame, [EffectValue("line", 0.3, {"period": 400.0, "phase": 45.0})])
    (found,) = fit.effects
    (o,) = frame.observations
    angle = 2.0 * np.pi * (o.time - o.time[0]) / 403.0
    columns = [np.sin(angle + np.radians(70.0)), 0.4 * np.cos(angle + np.radians(70.0))]
    columns.append(-columns[1] * angle / 403.0)
    white = frame.whiteners[0].whiten(np.column_stack([*columns, *o.model.columns().values()]))
    errors = np.sqrt(np.diag(np.linalg.inv(white.T @ white)))
    assert fit.standard_errors["line.amplitude"] == pytest.approx(errors[0], rel=0.1)
    assert fit.standard_errors["line.period"] == pytest.approx(errors[2], rel=0.1)
    assert abs(found.shape["period"] - 403.0) < 4.0 * errors[2]
    assert abs(found.amplitude - 0.4) < 4.0 * errors[0]


def test_a_whole_number_stays_what_the_grid_found():
    """Over many turns a fit would leave it for a number between two, where the response is another one."""
    toothed = EffectValue("toothed", 0.2, {"harmonic": 4.0, "phase": 30.0})
    model = SmallModel(("toothed",))
    run = ramps("a", count=400)
    frame = framed([recorded(run, model, TRUE, (toothed,), noise_of(run, np.random.default_rng(2)))], model)
    first = EffectValue("toothed", 0.1, {"harmonic": 4.0, "phase": 60.0})
    fit = fit_model(frame.observations, frame.whiteners, model.constants, [first], model.candidates())
    (effect,), errors = fit.effects, fit.standard_errors
    assert effect.shape["harmonic"] == 4.0 and "toothed.harmonic" not in errors
    assert effect.amplitude == pytest.approx(0.2, abs=3.0 * errors["toothed.amplitude"])
    assert effect.shape["phase"] == pytest.approx(30.0, abs=3.0 * errors["toothed.phase"])
    assert errors["toothed.amplitude"] < 0.02
    assert all("harmonic" in drawn[0].shape for _, drawn in fit.draws(np.random.default_rng(1), 3))


def test_what_a_response_is_linear_in_starts_near_its_best_value_whatever_its_unit():
    mixture = EffectValue("mixture", 5.0, {"share": 1.0})
    frame = ready(8, effects=(mixture,))
    given = (frame.observations, frame.whiteners, MODEL.constants, MEANS)
    (open_,) = starting_values(
        *given, [("mixture", node({"share": 0.2}, {"share": 0.5}))], MODEL.candidates()
    )
    (fixed,) = starting_values(*given, [("mixture", node({"share": 0.2}))], MODEL.candidates())
    assert open_.shape["share"] == 1.0 and fixed.shape["share"] == 0.2
