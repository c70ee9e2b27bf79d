"""The contract of the twin's effects, as a check of any effect: what it declares, and does."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.features.parse import parse_features
from fogml.gap.catalogue import FAMILIES
from fogml.numerals import percent
from fogml.testing.effect_inputs import (
    BLOCK_EDGES,
    SCRAMBLED,
    block,
    check_amplitude,
    hooks,
    in_block,
    rms,
    same,
    scrambled,
    signature,
    standard_inputs,
    still_stretch,
    without_rows,
)
from fogml.twin import registry
from fogml.twin.effect import SET_UP, STAGES, Effect, NoiseEffect, ThermalEffect
from fogml.twin.effect_guard import unguard
from fogml.twin.inputs import REST, STAND_INS, Inputs
from fogml.twin.memory import Memory
from fogml.twin.quantities import GRADES, Quantity
from fogml.twin.scenes import scene_names

_WORD = re.compile(r"[a-z]{2,}(_[a-z]{2,})*\Z")


def check_declaration(effect: Effect) -> None:
    """Names, texts and needs are stated and whole."""
    name = type(effect).__name__
    for attribute in ("code", "title", "stage", "amplitude"):
        assert hasattr(effect, attribute), f"{name} does not state '{attribute}'"
    assert effect.title.strip() and effect.code.strip(), f"{name}: title or letter code is empty"
    for stated in (effect.amplitude, *effect.shape):
        assert isinstance(stated, Quantity), f"{name}: {stated!r} is no Quantity"
    assert effect.stage in STAGES, f"{name}: stage '{effect.stage}' is none of {', '.join(STAGES)}"
    text = type(effect).__doc__ or ""
    assert "=" in text and "::" in text, f"{name}: the docstring states no equation after '::'"
    assert re.search(r"\bSources?:", text), f"{name}: the docstring has no line 'Source:'"
    assert effect.sources and all(source.strip() for source in effect.sources), f"{name} states no sources"
    assert effect.shows.strip(), f"{name} does not say where it shows"
    assert effect.shown_on in scene_names(), f"{name} is shown on '{effect.shown_on}', which is no scene"
    for other, what in effect.confused_with.items():
        assert other != effect.id and what.strip(), f"{name}: confused_with '{other}' says nothing"
    there = {*registry.effects(), effect.id}
    for other in (*effect.confused_with, *effect.conflicts):
        assert other in there, f"{name}: confused_with or conflicts name '{other}', which is no effect"
    families = ("signature", *FAMILIES)
    assert effect.family in families, f"{name}: family '{effect.family}' is none of {', '.join(families)}"
    for text in effect.compensated_by:
        parse_features(text.format(**effect.default_shape()))
    known = {*STAND_INS, *REST, *SET_UP}
    assert set(effect.needs) <= known, f"{name} needs {sorted(set(effect.needs) - known)}, which no input has"
    assert len(set(effect.needs)) == len(effect.needs), f"{name}: needs repeat"
    assert effect.id not in effect.conflicts, f"{name} conflicts with itself"
    assert effect.amplitude.name == "amplitude", f"{name}: the amplitude's key is 'amplitude'"
    names = [quantity.name for quantity in effect.shape]
    assert len(set(names)) == len(names) and "amplitude" not in names, f"{name}: shape names repeat: {names}"
    for quantity in names:
        assert _WORD.match(quantity), f"{name}: shape parameter '{quantity}' must be whole lower-case words"


def check_priors(effect: Effect) -> None:
    """Units, ranges, limits and the draws from the priors fit together."""
    rng = np.random.default_rng(0)
    for quantity in (effect.amplitude, *effect.shape):
        owner = f"{effect.id}: {quantity.name}"
        assert quantity.unit.strip(), f"{owner} has no unit; a pure number has unit '1'"
        low, high = quantity.limits
        assert low < high, f"{owner}: limits {quantity.limits} hold nothing"
        for grade in GRADES:
            least, most = quantity.range(grade)
            assert math.isfinite(least) and math.isfinite(most) and least <= most, (
                f"{owner}: {grade} range {least:g} to {most:g}"
            )
            assert low <= least and most <= high, f"{owner}: the {grade} range passes the limits"
            assert not quantity.signed or least >= 0.0, f"{owner}: a signed quantity's range is of its size"
            assert not quantity.signed or low == -high, f"{owner}: limits of a signed quantity are lopsided"
            assert quantity.check(quantity.typical(grade), owner) == quantity.typical(grade)
            drawn = np.array([quantity.draw(rng, grade) for _ in range(400)])
            assert np.isfinite(drawn).all() and drawn.min() >= low and drawn.max() <= high, (
                f"{owner}: its prior leaves the limits"
            )
            size = np.abs(drawn) if quantity.signed else drawn
            slack = 1e-9 * max(abs(least), abs(most))
            inside = np.mean((size >= least - slack) & (size <= most + slack))
            assert inside >= 0.8, (
                f"{owner}: only {percent(float(inside), 0)} of its {grade} prior lie in the range"
            )
    most_n, most_t = effect.amplitude.navigation[1], effect.amplitude.tactical[1]
    assert most_n <= most_t, f"{effect.id}: a navigation gyro is to have no more of it than a tactical one"


def check_values(effect: Effect) -> None:
    """Values as a twin file gives them: defaults are filled in, faults are named."""
    stated = {"amplitude": effect.amplitude.typical(), **effect.default_shape()}
    amplitude, shape = effect.checked({"amplitude": stated["amplitude"]})
    assert amplitude == stated["amplitude"] and shape == effect.default_shape(), (
        "values that are not stated do not take their defaults"
    )
    for values in ({**stated, "nonsense": 1.0}, {**stated, "amplitude": math.nan}, effect.default_shape()):
        try:
            effect.checked(values)
        except InputError as error:
            assert effect.id in str(error), f"the message does not name the effect: {error}"
        else:
            raise AssertionError(f"{effect.id} accepts {values}")


BLOCK_AGREEMENT = 1e-12
"""The same for block by block against the whole."""
SMOOTHNESS = 0.05
"""Greatest relative change of a slope against a shape parameter when the step is halved."""


def check_effect(effect: Effect | type[Effect] | str) -> None:
    """Check that an effect keeps the contract that simulator, diagnosis and documentation rely on.

    The checks: the declaration is whole, with units, ranges, priors, equation and source; the
    signature is finite on simulated inputs and on recordings that lack what is optional, and leaves
    its inputs alone; amplitude 0 changes nothing, and a small one what the signature says; no value
    depends on later samples, nor on anything outside `needs`, and everything in `needs` and every
    shape parameter matters; samples that are missing while nothing moves leave no trace; block by
    block gives what the whole run gives; slopes against the shape parameters by finite differences
    are finite and smooth; it registers and unregisters.

    Parameters
    ----------
    effect
        An effect, its class, or the id of one that is registered.

    Raises
    ------
    AssertionError
        Naming the part of the contract that is not kept.
    """
    known = unguard(copy(registry.effect(effect))) if isinstance(effect, str) else effect
    checked: Effect = known() if isinstance(known, type) else known
    inputs = standard_inputs()
    check_declaration(checked)
    check_priors(checked)
    check_values(checked)
    _check_finite(checked, inputs)
    _check_needs(checked, inputs)
    _check_causality(checked, inputs["programme"])
    _check_blocks(checked, inputs["programme"])
    if not isinstance(checked, NoiseEffect):
        _check_gap(checked, inputs["programme"])
        _check_shape(checked, inputs)
    check_amplitude(checked, inputs["programme"])
    _check_registry(checked)


def _check_finite(effect: Effect, inputs: Mapping[str, Inputs]) -> None:
    for grade in GRADES:
        shape = effect.default_shape(grade)
        for name, given in inputs.items():
            before = _columns(given)
            copies = {key: values.copy() for key, values in before.items()}
            found = signature(effect, given, shape)
            assert isinstance(found, np.ndarray) and found.dtype == np.float64, (
                f"{effect.id}: the signature on '{name}' is no float64 array"
            )
            shape_told = f"{effect.id}: the signature on '{name}' has shape {found.shape}"
            assert found.shape == (len(given),), f"{shape_told}, not ({len(given)},)"
            assert np.isfinite(found).all(), f"{effect.id}: not finite everywhere on '{name}'"
            again = signature(effect, given, shape)
            assert np.array_equal(found, again), f"{effect.id}: a second call on '{name}' differs"
            for key, values in copies.items():
                assert np.array_equal(values, before[key]), f"{effect.id}: the signature changed {key}"
            empty = signature(effect, block(given, 0, 0), shape)
            assert empty.shape == (0,), f"{effect.id}: no samples do not give an empty signature"


def _check_needs(effect: Effect, inputs: Mapping[str, Inputs]) -> None:
    shape = _off_default(effect)
    given = inputs["programme"]
    whole = signature(effect, given, shape)
    # The rate tells whole turns of an angle.
    with_angle = {"rate"} if "angle" in effect.needs else set()
    alone = signature(effect, scrambled(given, keep={*effect.needs, *with_angle}), shape)
    assert np.array_equal(whole, alone), (
        f"{effect.id}: its signature depends on inputs outside {effect.needs}"
    )
    bare = replace(given, drives={})
    for need in effect.needs:
        others = [name for name in SCRAMBLED if name != need]
        touched = any(
            not np.array_equal(
                signature(effect, base, shape),
                signature(effect, scrambled(base, keep=others, value=3.0), shape),
            )
            for base in (given, bare, inputs["quick"])
        )
        assert touched, f"{effect.id} states that it needs '{need}', which makes no difference to it"


def _check_causality(effect: Effect, inputs: Inputs) -> None:
    shape = _off_default(effect)
    half = len(inputs) // 2 + 7
    whole = signature(effect, inputs, shape)
    first = signature(effect, block(inputs, 0, half), shape)
    same(whole[:half], first, f"{effect.id}: a value depends on whether later samples exist")


def _check_blocks(effect: Effect, inputs: Inputs) -> None:
    shape = _off_default(effect)
    memory = Memory()
    edges = [0, *(int(share * len(inputs)) for share in BLOCK_EDGES), len(inputs)]
    pieces = [in_block(effect, block(inputs, start, stop, memory), shape) for start, stop in pairwise(edges)]
    whole = signature(effect, inputs, shape)
    what = f"{effect.id}: block by block and the whole run"
    same(whole, np.concatenate(pieces), what, agreement=BLOCK_AGREEMENT)


def _check_gap(effect: Effect, inputs: Inputs) -> None:
    """Samples that are missing in a soak, where nothing moves, must leave no trace beyond a window."""
    shape = _off_default(effect)
    still, (first, last) = still_stretch(inputs)
    whole = signature(effect, still, shape)
    cut = signature(effect, without_rows(still, first, last), shape)
    assert np.isfinite(cut).all(), f"{effect.id}: not finite after a gap"
    later = last + int(3.0 * inputs.rate_window_s / (inputs.time[1] - inputs.time[0])) + 1
    size = float(np.abs(whole).max())
    worst = float(np.abs(whole[later:] - cut[later - (last - first) :]).max(initial=0.0))
    assert worst <= 1e-6 * size, f"{effect.id}: a gap in a soak leaves a trace of {worst:.2g} of {size:.2g}"
    # In motion, a gap may cost accuracy but must not make a spike.
    moving = signature(effect, without_rows(inputs, len(inputs) // 4, len(inputs) // 4 + 60), shape)
    assert np.isfinite(moving).all() and np.abs(moving).max() <= 2.0 * np.abs(
        signature(effect, inputs, shape)
    ).max(initial=1e-300), f"{effect.id}: a gap in a ramp makes a spike"


def _check_shape(effect: Effect, inputs: Mapping[str, Inputs]) -> None:
    for quantity in effect.shape:
        shape = _off_default(effect)
        low, high = quantity.range("tactical")
        step = 1e-4 * max(abs(shape[quantity.name]), 0.1 * (high - low), 1e-6)
        least, most = quantity.limits
        shape[quantity.name] = float(np.clip(shape[quantity.name], least + step, most - step))
        matters = False
        for name in ("programme", "horizontal", "only T", "quick"):
            if matters and name in ("only T", "quick"):
                # A poorer recording, or a faster one, counts where others leave a parameter no say.
                continue
            coarse = _slope(effect, inputs[name], shape, quantity.name, step)
            fine = _slope(effect, inputs[name], shape, quantity.name, 0.5 * step)
            assert np.isfinite(coarse).all(), f"{effect.id}: slope against {quantity.name} is not finite"
            size, rough = rms(fine), rms(coarse - fine)
            matters = matters or size > 0.0
            assert rough <= SMOOTHNESS * size, (
                f"{effect.id}: slope against {quantity.name} changes by {percent(rough / size, 0)} "
                "with half the step"
            )
        if isinstance(effect, ThermalEffect) and not matters:
            above = _forward(
                effect, inputs["programme"], {**shape, quantity.name: shape[quantity.name] + step}
            )
            matters = not np.array_equal(above, _forward(effect, inputs["programme"], shape))
        assert matters, f"{effect.id}: shape parameter {quantity.name} makes no difference"


def _forward(effect: Effect, inputs: Inputs, shape: Mapping[str, float]) -> FloatArray:
    """What the forward hooks of an effect give at a usual amplitude."""
    amplitude = effect.amplitude.typical()
    return np.concatenate([apply(amplitude) for _, apply, _ in hooks(effect, inputs, shape)])


def _slope(effect: Effect, inputs: Inputs, shape: Mapping[str, float], name: str, step: float) -> FloatArray:
    above = signature(effect, inputs, {**shape, name: shape[name] + step})
    below = signature(effect, inputs, {**shape, name: shape[name] - step})
    return (above - below) / (2.0 * step)


def _off_default(effect: Effect) -> dict[str, float]:
    """Shape parameters a little off their defaults, where zeros and right angles hide nothing."""
    shape = effect.default_shape()
    for quantity in effect.shape:
        low, high = quantity.range("tactical")
        moved = shape[quantity.name] + 0.13 * (high - low)
        shape[quantity.name] = float(np.clip(moved, *quantity.limits))
    return shape


def _check_registry(effect: Effect) -> None:
    held = registry.effects().get(effect.id)
    if held is not None:
        registry.unregister(effect.id)
    try:
        registry.register(effect)
        assert registry.effect(effect.id) is effect, f"{effect.id} is not found after it was registered"
        try:
            registry.register(effect)
        except InputError:
            pass
        else:
            raise AssertionError(f"{effect.id} can be registered twice")
        registry.unregister(effect.id)
        assert effect.id not in registry.effects(), f"{effect.id} is still there after unregistering"
    finally:
        if effect.id in registry.effects():
            registry.unregister(effect.id)
        if held is not None:
            registry.register(held)


def _columns(inputs: Inputs) -> dict[str, FloatArray]:
    columns = {**inputs.temperatures, **inputs.drives, **{f"slope {k}": v for k, v in inputs.slopes.items()}}
    columns |= {"time": inputs.time, "table_rate": inputs.table_rate}
    if inputs.output is not None:
        columns["output"] = inputs.output
    return columns
