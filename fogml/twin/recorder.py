"""What loggers make of the output, block after block; a clock that runs ahead asks for samples to come."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.twin.chain import ChainOutput
from fogml.twin.inputs import Inputs
from fogml.twin.memory import Memory
from fogml.twin.twin import Twin


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of a block: what acts on the gyro, and the noise that comes on top [deg/h].

    A winding remembers, and a sensor follows, what temperature does while the unit is off. `on` are the
    samples in which it is on, which alone are recorded. `random` holds each random effect's part of the
    noise, where contributions are asked for, and `without`, for each thermal effect, the inputs as they would
    be without it.
    """

    inputs: Inputs
    on: slice | BoolArray
    noise: FloatArray
    random: dict[str, FloatArray]
    without: dict[str, Inputs]


Worked = tuple[Samples, ChainOutput]
"""A block's samples and what the chain makes of them."""


def looks_ahead_s(twin: Twin, hours: float) -> float:
    """How far the twin's loggers look ahead in a recording of so many hours [s]."""
    return sum(declared.ahead_s(hours, s.amplitude, **s.shape) for declared, s in twin.logging)


Later = tuple[FloatArray, FloatArray]
"""Times [s] and output [deg/h] of samples that follow, shape (m,) each."""


def logged(twin: Twin, output: FloatArray, inputs: Inputs, later: Later | None = None) -> ChainOutput:
    """The output as it is recorded [deg/h], and what each logger effect changes in it."""
    parts: dict[str, FloatArray] = {}
    count = len(output)
    if not count:
        # A block in which the unit is off.
        return ChainOutput(output, parts)
    if later is not None:
        time, output = np.append(inputs.time, later[0]), np.append(output, later[1])
    for declared, setting in twin.logging:
        before, given = output, inputs.with_output(output)
        if later is not None:
            # What is looked at leaves the memory alone.
            given = replace(given, time=time, memory=deepcopy(inputs.memory))
            own = before[:count]
            declared.record(own, inputs.with_output(own), setting.amplitude, **setting.shape)
        output = declared.record(before, given, setting.amplitude, **setting.shape)
        parts[declared.id] = (output - before)[:count]
    return ChainOutput(output[:count], parts)


def recorded_output(
    twin: Twin, memory: Memory, now: Worked, later: Worked | None, *, noisy: bool
) -> ChainOutput:
    """The same of a block's samples in which the unit is on, with a look at those of the next, if given."""
    following = None
    if later is not None:
        following = later[0].inputs.time[later[0].on], _put_out(*later, noisy)
    inputs = chosen(now[0].inputs, now[0].on, memory)
    return logged(twin, _put_out(*now, noisy), inputs, following)


def _put_out(samples: Samples, chain: ChainOutput, noisy: bool) -> FloatArray:
    return np.asarray((chain.output + samples.noise if noisy else chain.output)[samples.on])


def chosen(inputs: Inputs, rows: slice | BoolArray, memory: Memory) -> Inputs:
    """Some of the samples, with a memory of their own."""
    if isinstance(rows, slice) and rows == slice(None):
        return replace(inputs, memory=memory)
    temperatures, drives = (
        {name: values[rows] for name, values in columns.items()}
        for columns in (inputs.temperatures, inputs.drives)
    )
    time, rate = inputs.time[rows], inputs.table_rate[rows]
    return replace(
        inputs, time=time, temperatures=temperatures, table_rate=rate, drives=drives, memory=memory, cache={}
    )
