"""The oracle: given the true form of what may be missing, it only asks whether it is there.

What the data allow: for each truly missing effect, and for the unknown ones together, the likelihood
ratio between its true contribution and none, whitened by the true noise, nominal constants
integrated out, the other missing effects known. No method that must find the form can do better.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.special import expit

from fogml.arrays import FloatArray
from fogml.blind.baselines.answer import Finding, Prediction, write_answer
from fogml.blind.folders import BlindFolder, case_files
from fogml.blind.signatures import Stack
from fogml.blind.truth import Truth, read_contributions
from fogml.signals.noise_model import NoiseModel


def oracle(folder: BlindFolder, truth: Truth, out: Path) -> None:
    """Answer one case of a suite with its truth at hand."""
    files = case_files(folder.cases / truth.case)
    given = read_contributions(folder.truth / f"{truth.case}.npz")
    noise = truth.noise_model
    fit, held_out = Stack(files.fit), Stack(files.held_out)
    contributions = [
        np.column_stack(
            [stack.averaged([given[run, i] for run in stack.names]) for i in range(len(truth.effects))]
            or [np.zeros((len(stack), 0))]
        )
        for stack in (fit, held_out)
    ]
    seen, target = _beside_constants(fit, noise, np.column_stack([contributions[0], fit.gap]))
    left = target - seen.sum(axis=1)
    odds = [float((left + s) @ s - 0.5 * s @ s) for s in seen.T]
    found = []
    for effect, ratio, s in zip(truth.effects, odds, seen.T):
        if effect.id is None or effect not in truth.known:
            continue
        true = effect.amplitude.value if effect.amplitude else 1.0
        # What the noise makes of the amplitude, were its form known.
        fitted = true * (1.0 + float(left @ s) / float(s @ s))
        se = abs(true) / float(np.linalg.norm(s))
        found.append(Finding(effect.id, (effect.id,), float(expit(ratio)), fitted, se, dict(effect.shape)))
    hidden = [i for i, effect in enumerate(truth.effects) if effect in truth.unknown]
    unknown = 0.0
    if hidden:
        s = seen[:, hidden].sum(axis=1)
        unknown = float(expit((left + s) @ s - 0.5 * s @ s))
    # The unknown stays: the oracle may see it, but has no name to add it by.
    named = [i for i, effect in enumerate(truth.effects) if effect in truth.known and odds[i] > 0.0]
    nothing = _constants(fit, noise, fit.gap)
    rest = _constants(fit, noise, fit.gap - contributions[0][:, named].sum(axis=1))
    predictions = [
        Prediction(stack, stack.nominal @ nothing, stack.nominal @ rest + s[:, named].sum(axis=1))
        for stack, s in zip((fit, held_out), contributions)
    ]
    total = contributions[0].sum(axis=1)
    structural = total - fit.nominal @ _constants(fit, noise, total)
    write_answer(out, found, unknown, predictions[0], predictions[1], noise, structural)


def _design(stack: Stack, noise: NoiseModel) -> FloatArray:
    """Whitened columns of the constants, in units of their priors, the priors' rows below."""
    columns = stack.whitened(noise, stack.nominal * stack.prior_sd)
    return np.concatenate([columns, np.eye(columns.shape[1])])


def _beside_constants(stack: Stack, noise: NoiseModel, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Whitened columns less what the constants make up for; the last one apart."""
    design = _design(stack, noise)
    white = np.concatenate([stack.whitened(noise, columns), np.zeros((design.shape[1], columns.shape[1]))])
    basis, _ = np.linalg.qr(design)
    left = white - basis @ (basis.T @ white)
    return left[:, :-1], left[:, -1]


def _constants(stack: Stack, noise: NoiseModel, gap: FloatArray) -> FloatArray:
    design = _design(stack, noise)
    target = np.concatenate([stack.whitened(noise, gap), np.zeros(design.shape[1])])
    return stack.prior_sd * np.linalg.lstsq(design, target, rcond=None)[0]
