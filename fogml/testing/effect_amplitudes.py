"""How an effect goes with its amplitude, as a check: its forward hooks against its signature."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.effect import (
    Effect,
    LoggerEffect,
    LoopEffect,
    NoiseEffect,
    RigEffect,
    ScaleFactorEffect,
    SensorEffect,
    ThermalEffect,
)
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory

AGREEMENT = 1e-9
"""Greatest difference between two ways to the same value, relative to the values' size."""


def check_amplitude(effect: Effect, inputs: Inputs) -> None:
    """Amplitude 0 changes nothing, and a small one what the signature says."""
    shape = effect.default_shape()
    response = effect.response(fresh(inputs), **shape)
    assert response.shape == (len(inputs),) and np.isfinite(response).all(), (
        f"{effect.id}: response has wrong shape or is not finite"
    )
    if isinstance(effect, ScaleFactorEffect):
        wanted = 1e-6 * inputs.input_rate_deg_h * signature(effect, inputs, shape)
        same(wanted, response, f"{effect.id}: response is not the input rate times the ppm")
    if isinstance(effect, RigEffect):
        _check_added_rate(effect, inputs, shape)
    for name, apply, untouched in hooks(effect, inputs, shape):
        same(untouched, apply(0.0), f"{effect.id}: {name} with amplitude 0 changes something", agreement=0.0)
        changed = apply(effect.amplitude.typical())
        assert changed.shape == untouched.shape and np.isfinite(changed).all(), (
            f"{effect.id}: {name} gives a wrong shape or values that are not finite"
        )
    if isinstance(effect, LoopEffect):
        output = inputs.output
        assert output is not None
        # One not in proportion to its amplitude has the signature of the usual amplitude.
        step = 1e-3 * effect.amplitude.typical("navigation")
        step = effect.amplitude.typical() if effect.amplitudes else step
        change = effect.apply(output, fresh(inputs), step, **shape) - output
        wanted = step * signature(effect, inputs, shape)
        slack = 0.02 * rms(wanted) + 1e-14 * float(np.abs(output).max())
        assert rms(change - wanted) <= slack, (
            f"{effect.id}: apply is not the amplitude times the signature for a small amplitude"
        )


def _check_added_rate(effect: RigEffect, inputs: Inputs, shape: Mapping[str, float]) -> None:
    """For a small amplitude, `added_rate` is the amplitude times the signature."""
    step = 1e-3 * effect.amplitude.typical("navigation")
    wanted = signature(effect, inputs, shape)
    half, whole = (effect.added_rate(wanted, fresh(inputs), a, **shape) for a in (0.5 * step, step))
    # Four halves less the whole: terms of second order are gone.
    slope = (4.0 * half - whole) / step
    assert rms(slope - wanted) <= 1e-6 * rms(wanted), (
        f"{effect.id}: the slope of added_rate at amplitude 0 is not the signature"
    )


def hooks(
    effect: Effect, inputs: Inputs, shape: Mapping[str, float]
) -> Iterator[tuple[str, Callable[[float], FloatArray], FloatArray]]:
    """Each forward hook of an effect as a function of the amplitude, with what it starts from."""
    assert inputs.output is not None
    output = inputs.output
    if isinstance(effect, RigEffect):
        small = signature(effect, inputs, shape)
        still = np.zeros(len(inputs))
        yield "added_rate", lambda a: effect.added_rate(small, fresh(inputs), a, **shape), still
    if isinstance(effect, LoopEffect):
        yield "apply", lambda a: effect.apply(output, fresh(inputs), a, **shape), output
    if isinstance(effect, SensorEffect):
        for name in ("T", "T_in", "T_out", "T_electronics"):
            true = inputs.temperatures[name]

            def sensed(a: float, name: str = name, true: FloatArray = true) -> FloatArray:
                return effect.sense(name, true, fresh(inputs), a, **shape)

            yield "sense", sensed, true
    if isinstance(effect, LoggerEffect):
        yield "record", lambda a: effect.record(output, fresh(inputs), a, **shape), output
    if isinstance(effect, ThermalEffect):
        from fogml.twin.plant.standard import standard_network

        chamber, plant = inputs.temperatures["T_chamber"], standard_network()
        yield "change_chamber", lambda a: effect.change_chamber(chamber, fresh(inputs), a, **shape), chamber

        def solved(a: float) -> FloatArray:
            nodes = effect.change_plant(plant, a, **shape).temperatures(
                inputs.time,
                chamber,
                powered=((0.0, inputs.power_ons_s[0] - 600.0), (inputs.power_ons_s[0], np.inf)),
                fan=inputs.drives["fan"],
                table_rate=inputs.table_rate,
            )
            return np.concatenate([nodes[name] for name in plant.nodes])

        start = plant.temperatures(inputs.time, chamber)
        yield "change_plant", solved, np.concatenate([start[name] for name in plant.nodes])
    if isinstance(effect, NoiseEffect):

        def drawn(a: float) -> FloatArray:
            return effect.draw(np.random.default_rng(1), len(inputs), 10.0, a, **shape)

        yield "draw", drawn, np.zeros(len(inputs))
        assert np.array_equal(drawn(1.0), drawn(1.0)), f"{effect.id}: the same seed draws other numbers"


def rms(values: FloatArray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values * values)))


def fresh(inputs: Inputs) -> Inputs:
    """The inputs with no memory and nothing worked out yet."""
    return replace(inputs, memory=Memory(), cache={})


def signature(effect: Effect, inputs: Inputs, shape: Mapping[str, float]) -> FloatArray:
    """The signature on a whole run; of a random error, which has none, the strength."""
    return in_block(effect, fresh(inputs), shape)


def in_block(effect: Effect, inputs: Inputs, shape: Mapping[str, float]) -> FloatArray:
    """The same on a block, with the memory that it brings along."""
    if isinstance(effect, NoiseEffect):
        return np.broadcast_to(effect.strength(inputs, **shape), (len(inputs),)).astype(np.float64)
    return effect.signature(inputs, **shape)


def same(wanted: FloatArray, found: FloatArray, what: str, *, agreement: float = AGREEMENT) -> None:
    """Fail where two arrays differ."""
    assert wanted.shape == found.shape, f"{what}: shapes {wanted.shape} and {found.shape}"
    size = float(np.abs(wanted).max(initial=0.0))
    worst = float(np.abs(wanted - found).max(initial=0.0))
    assert worst <= agreement * size, f"{what}: they differ by {worst:.2g}, size {size:.2g}"
