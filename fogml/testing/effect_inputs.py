"""Inputs that effects are checked on: a programme with everything in it, and poorer recordings."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np

from fogml.arrays import FloatArray, IntArray
from fogml.runs.facts import Facts
from fogml.twin.chain import fresh
from fogml.twin.effect import (
    SET_UP,
    Effect,
    LoggerEffect,
    LoopEffect,
    NoiseEffect,
    RigEffect,
    ScaleFactorEffect,
    SensorEffect,
    ThermalEffect,
)
from fogml.twin.inputs import REST, STAND_INS, Inputs
from fogml.twin.memory import Memory
from fogml.twin.optics import Coil
from fogml.twin.plant.standard import standard_network

SAMPLE_S = 10.0
QUICKER = 1e-4
"""Of the programme's clock: samples of 1 ms."""
BLOCK_EDGES = (0.001, 0.13, 0.1305, 0.5, 0.77)
"""Where the blocks of a blockwise check begin, as shares of the run."""
SCRAMBLED = (*STAND_INS, *REST, *SET_UP)
"""Everything beside time that an effect may need."""


def standard_inputs() -> dict[str, Inputs]:
    """Inputs by name: a simulated programme, and recordings of several kinds.

    ``programme`` has every node and drive, turns, a thermal shock, power-on at the start and a
    power cycle; ``horizontal`` is the same with the input axis to the east; ``only T`` is a
    recording with one sensor and no facts; ``two faces`` one with ``T_in`` and ``T_out``;
    ``irregular`` has uneven steps and gaps; ``still`` never moves; ``quick`` is the programme in ten
    thousandth of its time, for what only fast changes show.
    """
    programme = _programme()
    bare = replace(programme, drives={}, facts=Facts(), powered_on_s=-np.inf, power_ons_s=(), earth_deg_h=0.0)
    nodes = programme.temperatures
    rng = np.random.default_rng(5)
    keep = np.sort(rng.permutation(len(programme))[: int(0.8 * len(programme))])
    keep = keep[(keep < 700) | (keep > 760)]
    still = {name: np.full(len(programme), 31.0) for name in nodes}
    east = programme.facts.model_copy(update={"input_axis": "east"})
    return {
        "programme": programme,
        "horizontal": replace(programme, facts=east, earth_deg_h=0.0),
        "only T": replace(bare, temperatures={"T": nodes["T"]}, slopes={"T": programme.slopes["T"]}),
        "two faces": replace(bare, temperatures={name: nodes[name] for name in ("T_in", "T_out")}),
        "irregular": rows(programme, keep),
        "quick": replace(programme, time=QUICKER * programme.time, power_ons_s=(QUICKER * 27000.0,)),
        "still": replace(bare, temperatures=still, table_rate=np.zeros(len(programme))),
    }


def _programme() -> Inputs:
    """25 to -40 to 60 degC and a shock to 0 degC, about 9 h at 0.1 Hz, turning in the soaks."""
    points = [(0, 25), (30, 25), (95, -40), (215, -40), (315, 60), (435, 60), (438, 0), (530, 0)]
    minutes, set_point = np.array(points, dtype=np.float64).T
    time = np.arange(0.0, 60.0 * minutes[-1], SAMPLE_S)
    chamber = np.interp(time / 60.0, minutes, set_point)
    n = len(time)
    nodes = {name: np.ascontiguousarray(values) for name, values in _nodes(time, chamber).items()}
    nodes["T"] = nodes["T_in"]
    nodes["T_leads"] = 0.5 * (nodes["T_hub"] + nodes["T_electronics"])
    nodes["T_top"] = 0.5 * (nodes["T_case"] + nodes["T_out"])
    nodes["T_bottom"] = 0.5 * (nodes["T_plate"] + nodes["T_out"])
    table_rate = np.zeros(n)
    for start, rate in ((60, 10.0), (900, -10.0), (906, 10.0), (2300, 2e-3), (2310, -2e-3), (2400, -600.0)):
        table_rate[start : start + 6] = rate
    wave = np.sin(2.0 * np.pi * time / 1800.0)
    drives = {
        "power": 5.0 + 0.5 * wave,
        "supply": 28.0 + 0.2 * (time > 9000.0) + 0.05 * wave,
        "humidity": np.where(time > 12000.0, 20.0, 50.0),
        "vibration": 0.02 + 0.05 * (wave > 0.0),
        "compressor": (wave > 0.3).astype(np.float64),
        "heater": (wave < -0.3).astype(np.float64),
        "fan": np.where((time > 15000.0) & (time < 15600.0), 0.0, 1.0),
        "B_x": 20.0 + 5.0 * wave,
        "B_y": -8.0 + 3.0 * np.cos(2.0 * np.pi * time / 2400.0),
        "B_z": 40.0 + 2.0 * wave**2,
        "shaking": np.abs(wave),
        "dose": 1.0 + 0.1 * (time / 3600.0) ** 2,
    }
    shaped = 3600.0 * table_rate + 7.5 + 0.02 * (nodes["T"] - 25.0)
    slopes = {"T": 0.02 + 1e-4 * (nodes["T"] - 25.0), "T_in": np.full(n, 0.3), "T_out": np.full(n, -0.3)}
    return Inputs(
        time=time,
        temperatures=nodes,
        table_rate=table_rate,
        earth_deg_h=7.520533,
        facts=Facts(unit="CHECK-1", axis="x", latitude=30.0, input_axis="up", powered_on=0.0),
        powered_on_s=0.0,
        power_ons_s=(27000.0,),
        drives=drives,
        coil=Coil(lead_1=0.5, lead_2=0.3),
        output=shaped,
        slopes=slopes,
    )


def _nodes(time: FloatArray, chamber: FloatArray) -> dict[str, FloatArray]:
    # A tenth of the usual delays: a shock of the air then still is one for the coil.
    network = standard_network().with_heating(5.0, 8.0, 1200.0)
    capacities = {name: 0.1 * value for name, value in network.capacities.items()}
    quick = replace(network, capacities=capacities)
    return quick.temperatures(time, chamber, powered=((0.0, 26400.0), (27000.0, np.inf)))


def block(inputs: Inputs, start: int, stop: int, memory: Memory | None = None) -> Inputs:
    """The rows [start, stop) as a block that goes on from a memory, a fresh one if None."""
    return rows(inputs, slice(start, stop), memory)


def rows(inputs: Inputs, which: slice | IntArray, memory: Memory | None = None) -> Inputs:
    """Some rows of inputs."""
    return replace(
        inputs,
        time=inputs.time[which],
        temperatures={name: values[which] for name, values in inputs.temperatures.items()},
        table_rate=inputs.table_rate[which],
        drives={name: values[which] for name, values in inputs.drives.items()},
        output=None if inputs.output is None else inputs.output[which],
        slopes={name: values[which] for name, values in inputs.slopes.items()},
        memory=Memory() if memory is None else memory,
        cache={},
    )


def without_rows(inputs: Inputs, first: int, last: int) -> Inputs:
    """The inputs with the rows [first, last) missing."""
    return rows(inputs, np.r_[0:first, last : len(inputs)])


def still_stretch(inputs: Inputs) -> tuple[Inputs, tuple[int, int]]:
    """The inputs with everything held for two hours, and the rows of the hour in the middle of it."""
    per_hour = int(3600.0 / SAMPLE_S)
    start = len(inputs) // 3
    source = np.r_[0 : start + 1, np.full(2 * per_hour, start), start + 1 : len(inputs)]
    held = rows(inputs, source)
    time = inputs.time[0] + SAMPLE_S * np.arange(len(source))
    table_rate = held.table_rate.copy()
    table_rate[start : start + 2 * per_hour] = 0.0
    held = replace(held, time=time, table_rate=table_rate)
    return held, (start + per_hour // 2, start + per_hour // 2 + per_hour)


def scrambled(inputs: Inputs, keep: Collection[str], value: float = np.nan) -> Inputs:
    """The inputs with all that is not in `keep` set to NaN, or moved by a wave of size `value`."""

    def spoil(column: FloatArray, name: str) -> FloatArray:
        if name in keep:
            return column
        if np.isnan(value):
            return np.full_like(column, np.nan)
        return column + value * np.sin(np.arange(len(column)) / 20.0)

    def number(held: float, name: str) -> float:
        return held if name in keep else (np.nan if np.isnan(value) else held + 100.0 * value)

    drives = {name: spoil(column, name) for name, column in inputs.drives.items()}
    # The angle follows from the rate; a column of its own tells the two apart.
    drives["angle"] = spoil(replace(inputs, memory=Memory(), cache={}).angle_deg, "angle")
    return replace(
        inputs,
        temperatures={name: spoil(column, name) for name, column in inputs.temperatures.items()},
        table_rate=spoil(inputs.table_rate, "rate"),
        earth_deg_h=number(inputs.earth_deg_h, "earth"),
        facts=inputs.facts if "facts" in keep else Facts(),
        powered_on_s=number(inputs.powered_on_s, "powered_on"),
        power_ons_s=inputs.power_ons_s if "powered_on" in keep else (),
        drives=drives,
        output=None if inputs.output is None else spoil(inputs.output, "output"),
        slopes={name: spoil(column, "slopes") for name, column in inputs.slopes.items()},
        memory=Memory(),
        cache={},
    )


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


def signature(effect: Effect, inputs: Inputs, shape: Mapping[str, float]) -> FloatArray:
    """The signature on a whole run; of a random error, which has none, the strength."""
    return in_block(effect, fresh(inputs), shape)


def in_block(effect: Effect, inputs: Inputs, shape: Mapping[str, float]) -> FloatArray:
    """The same on a block, with the memory that it brings along."""
    try:
        if isinstance(effect, NoiseEffect):
            return np.broadcast_to(effect.strength(inputs, **shape), (len(inputs),)).astype(np.float64)
        return effect.signature(inputs, **shape)
    except Exception as error:  # others' code raises whatever it likes
        held = f"{len(inputs)} rows with {', '.join(inputs.temperatures)}"
        raise AssertionError(f"{effect.id}: {type(error).__name__} ({error}) on {held}") from error


def same(wanted: FloatArray, found: FloatArray, what: str, *, agreement: float = AGREEMENT) -> None:
    """Fail where two arrays differ."""
    assert wanted.shape == found.shape, f"{what}: shapes {wanted.shape} and {found.shape}"
    size = float(np.abs(wanted).max(initial=0.0))
    worst = float(np.abs(wanted - found).max(initial=0.0))
    assert worst <= agreement * size, f"{what}: they differ by {worst:.2g}, size {size:.2g}"
