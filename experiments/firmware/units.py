"""Simulated units with one thermometer, and exported C compiled into this process to run them."""

from __future__ import annotations

import ctypes
import re
import subprocess
import tempfile
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from experiments.synthetic_world import World, cycle
from fogml.arrays import FloatArray
from fogml.export.c_program import FLAGS, host_compiler
from fogml.export.c_source import SOURCE, CSource
from fogml.export.check import expected_outputs
from fogml.models.base import DriftModel
from fogml.models.names import make_model
from fogml.runs.run import Run

FEATURES = "T^1..3, dT, T*dT"
NOISE_DEGC = 0.005
_BLOCK = 1 << 19
_STEP = 1.0 / 256.0
_FEEDER = """
#include "fogml_model.c"
void feed(fogml_state *state, int64_t count, uint64_t start_us, uint64_t step_us, const {T} *temperatures,
          const {G} *gyro, {G} *out, int8_t *flag)
{{
    int64_t i;
    for (i = 0; i < count; i++) {{
        fogml_time time_us = (fogml_time)(start_us + (uint64_t)i * step_us);
        flag[i] = (int8_t)fogml_step(state, time_us, &temperatures[i], gyro[i], &out[i]);
    }}
}}
unsigned long state_bytes(void) {{ return sizeof(fogml_state); }}
"""
_NUMPY = {"double": "f8", "float": "f4", "int32_t": "i4", "int16_t": "i2"}


def trained_model(features: str = FEATURES) -> DriftModel:
    """A polynomial trained on a synthetic unit at three rates of temperature."""
    rates = np.concatenate([cycle(rate) for rate in (0.5, 1.0, 2.0)])
    trained, _ = World(noise=0.1).run(rates, 1.0, 1, "train.csv")
    columns = {"time": trained.time, "gyro": trained.gyro, "T": trained.columns["T_in"]}
    return make_model("polynomial", features).fit(Run("train.csv", columns))


class Unit:
    """Compiled C with a state of its own."""

    def __init__(self, source: CSource, *flags: str) -> None:
        self._numbers, self.dtype, self.code = source.numbers, source.dtype, code_of(source)
        kinds = {"T": source.numbers["temperature_type"], "G": source.numbers["gyro_type"]}
        self._kinds = {name: np.dtype(_NUMPY[kind]) for name, kind in kinds.items()}
        self._folder = tempfile.TemporaryDirectory()
        folder = Path(self._folder.name)
        source = source.with_expected(*expected_outputs(source, folder))
        for name, text in {**source.files, "feed.c": _FEEDER.format(**kinds)}.items():
            (folder / name).write_text(text, encoding="utf-8")
        # The same bits as with less of it, sooner.
        words = [host_compiler(), *FLAGS, "-O3", *flags, "-shared", "-fPIC", "-o", str(folder / "unit.so")]
        subprocess.run([*words, str(folder / "feed.c")], check=True)
        self._library = ctypes.CDLL(str(folder / "unit.so"))
        self._state = ctypes.create_string_buffer(self._library.state_bytes())
        self._library.fogml_init(self._state)
        if self._library.fogml_self_test() != 0:
            raise RuntimeError(f"the self-test of {self.dtype} fails")

    def feed(self, start_us: int, step_us: int, T: FloatArray, gyro: FloatArray) -> tuple[FloatArray, Any]:
        """Outputs [deg/h] and flags of samples."""
        fixed = self._numbers["fixed"]
        unit = 1.0
        if fixed:
            unit = fixed["compensated_value"]
            T = np.nan_to_num(T / fixed["temperature_value"], nan=-1e30)
            info = np.iinfo(self._kinds["T"])
            T, gyro = np.clip(np.round(T), info.min, info.max), np.round(gyro / fixed["gyro_value"])
        temperatures, output = T.astype(self._kinds["T"]), gyro.astype(self._kinds["G"])
        out, flag = np.empty(len(T), self._kinds["G"]), np.empty(len(T), np.int8)
        places = [a.ctypes.data_as(ctypes.c_void_p) for a in (temperatures, output, out, flag)]
        start = ctypes.c_uint64(start_us % (1 << 64))
        self._library.feed(self._state, ctypes.c_int64(len(T)), start, ctypes.c_uint64(step_us), *places)
        return out.astype(np.float64) * unit, flag


def code_of(source: CSource) -> str:
    """What tells generated C that runs apart: a hash of its text without self-test, comments and numbers."""
    runs, _, _ = source.files[SOURCE].partition("/* ---- Self-test")
    text = re.sub(r"/\*.*?\*/", "", runs, flags=re.DOTALL)
    return sha256(re.sub(r"-?\d[\w.]*(e-?\d+f?)?", "0", text).encode()).hexdigest()[:8]


def temperatures(time: FloatArray, seed: int) -> FloatArray:
    """A unit's days [degC]: a day's course, hours of load, minutes of a fan; read in steps with noise."""
    T = 22.0 + 12.0 * np.sin(time / 86400.0 * 2.0 * np.pi) + 6.0 * np.sin(time / 5100.0)
    T += 0.6 * np.sin(time / 410.0)
    noise = np.random.default_rng([seed, len(time), int(time[0])]).standard_normal(len(time))
    return np.round((T + NOISE_DEGC * noise) / _STEP) * _STEP


def blocks(seconds: float, sample_s: float, seed: int) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Times and temperatures of a recording, block by block."""
    count = round(seconds / sample_s)
    for low in range(0, count, _BLOCK):
        time = sample_s * np.arange(low, min(low + _BLOCK, count))
        yield time, temperatures(time, seed)
