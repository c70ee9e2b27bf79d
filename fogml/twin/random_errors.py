"""Random errors of a simulation on one clock: the gyro's noise terms and the random effects that are on."""

from __future__ import annotations

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.twin.effect import NoiseEffect
from fogml.twin.inputs import Inputs
from fogml.twin.noise import TERM_EFFECTS, NoiseConstants, NoiseSource, stream
from fogml.twin.twin import EffectSetting, Twin


class RandomErrors:
    """The noise of a simulation, block after block; each effect is a source of its own.

    Parameters
    ----------
    twin
        Whose noise terms and random effects they are.
    seed
        The same seed gives the same noise, whatever the blocks.
    count, sample_s
        Samples of the programme, and their interval [s].
    apart
        Whether to keep the part of each effect.
    """

    def __init__(self, twin: Twin, seed: int, count: int, sample_s: float, *, apart: bool) -> None:
        self._apart, self._passed = apart, 0
        self._own = NoiseSource(twin.noise, seed, sample_s)
        self._terms: dict[str, NoiseSource] = {}
        self._varying: list[tuple[NoiseEffect, EffectSetting, FloatArray]] = []
        self._steady: dict[str, FloatArray] = {}
        self._sum: FloatArray | None = None
        for declared, setting in twin.random:
            name = f"effect {declared.id}"
            if declared.id in TERM_EFFECTS:
                constants = NoiseConstants(**{TERM_EFFECTS[declared.id]: setting.amplitude})
                self._terms[declared.id] = NoiseSource(constants, seed, sample_s, name)
                continue
            drawn = declared.draw(stream(seed, name), count, sample_s, setting.amplitude, **setting.shape)
            if type(declared).strength is not NoiseEffect.strength:
                self._varying.append((declared, setting, drawn))
                continue
            if apart:
                self._steady[declared.id] = drawn
            # One record for all of them: long ones would fill the memory.
            self._sum = drawn.copy() if self._sum is None else np.add(self._sum, drawn, self._sum)

    def block(
        self, count: int, on: slice | BoolArray, inputs: Inputs
    ) -> tuple[FloatArray, dict[str, FloatArray]]:
        """The noise over the next block [deg/h], and each random effect's part of it.

        Parameters
        ----------
        count
            Samples of the block, on or off.
        on
            Those in which the unit is on.
        inputs
            What acts on the gyro in those.
        """
        noise = self._own.block(count)[on]
        rows = slice(self._passed, self._passed + count)
        self._passed += count
        parts: dict[str, FloatArray] = {}
        for id, source in self._terms.items():
            parts[id] = source.block(count)[on]
        for declared, setting, drawn in self._varying:
            parts[declared.id] = drawn[rows][on] * declared.strength(inputs, **setting.shape)
        for part in parts.values():
            noise += part
        if self._sum is not None:
            noise += self._sum[rows][on]
        if not self._apart:
            return noise, {}
        return noise, parts | {id: drawn[rows][on] for id, drawn in self._steady.items()}
