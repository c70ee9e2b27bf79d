"""The unknown on a table: what goes with its rate, its angle, and both with temperature."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fogml.gap.group import BANDS_S, EDGES_S, Kind, lag, shared_differences, temperature_rate
from fogml.gap.observation import Observation
from fogml.runs.run import FloatArray
from fogml.signals.sample_means import mean_cosine, with_whole_turns
from fogml.twin.memory import Memory

HARMONICS, HARMONICS_OF_RATE = 3, 8
"""Harmonics of a turn that a bias may have, and an error of the rate."""


def table_groups(observations: Sequence[Observation]) -> list[Kind]:
    """The groups that these runs can show; none on a table that stands still."""
    groups: list[Kind] = []
    turns = any(np.any(o.run.rate) for o in observations)
    if turns:
        groups += [
            ("table_rate", "follows the table's rate", _table(observations)),
            (
                "scale_factor",
                "is a scale factor that goes with past temperatures or other places",
                _scale_factor(observations),
            ),
        ]
    waves = [_waves(o, HARMONICS) for o in observations]
    if all(np.ptp(held[:, :2], axis=0).max() <= 1e-3 for held in waves):
        return groups
    heat = "follows the rate of temperature by the table's angle"
    groups += [
        ("angle", "goes with the table's angle", [_angle(o, w) for o, w in zip(observations, waves)]),
        ("angle_heat", heat, _heat_by_angle(observations, waves)),
    ]
    if turns:
        words = "follows the table's rate by its angle"
        finer = [_share_of_rate(o)[:, None] * _waves(o, HARMONICS_OF_RATE) for o in observations]
        groups.append(("angle_rate", words, finer))
    return groups


def _table(observations: Sequence[Observation]) -> list[FloatArray]:
    top = max(float(np.abs(o.run.rate).max()) for o in observations)
    blocks = []
    for o in observations:
        rate = o.averaged(o.run.rate) / top
        size = np.abs(rate)
        u = (o.temperature - 25.0) / 50.0
        hours = (o.time - o.time[0]) / 36000.0
        direct = [size, rate**2, rate**3, np.sign(np.round(rate, 6)), size * u, rate * u**3]
        after = [lag(o, rate, tau) - rate for tau in EDGES_S] + [lag(o, size, tau) - size for tau in EDGES_S]
        blocks.append(
            np.column_stack([*direct, rate * lag(o, temperature_rate(o), 100.0), rate * hours, *after])
        )
    return blocks


def _scale_factor(observations: Sequence[Observation]) -> list[FloatArray]:
    """The rate times past temperatures, free of the readings' noise that the nominal replay holds too."""
    names = shared_differences(observations)
    top = max(float(np.abs(o.run.rate).max()) for o in observations)
    blocks = []
    for o in observations:
        rate, t = o.averaged(o.run.rate) / top, lag(o, o.temperature, BANDS_S[1])
        held = [lag(o, o.temperature, tau) - t for tau in BANDS_S[2:]]
        held += [lag(o, o.averaged(o.run.temperature(name)), BANDS_S[1]) - t for name in names]
        plays = Memory()
        held += [plays.play(f"{w}", t, w) - t for w in (4.0, 16.0)]
        blocks.append(np.column_stack([rate * h / 10.0 for h in held]))
    return blocks


def _waves(o: Observation, harmonics: int) -> FloatArray:
    """Harmonics of the table's angle, recorded or followed from its rate, shape (m, 2 * harmonics)."""
    recorded = o.run.columns.get("angle")
    told = o.run.rate * np.diff(o.run.time, prepend=o.run.time[0])
    angle = np.cumsum(told) if recorded is None else recorded
    after = np.radians(angle)
    before = after - np.radians(with_whole_turns(np.diff(angle, prepend=angle[0]), told))
    return np.column_stack(
        [
            o.averaged(mean_cosine(k * before - phase, k * after - phase))
            for k in range(1, harmonics + 1)
            for phase in (0.0, 0.5 * np.pi)
        ]
    )


def _angle(o: Observation, waves: FloatArray) -> FloatArray:
    """Harmonics of the angle, steady or over temperature."""
    u = ((o.temperature - 25.0) / 50.0)[:, None]
    first = waves[:, :2]
    return np.concatenate([waves, first * u, first * u**2], axis=1)


def _heat_by_angle(observations: Sequence[Observation], waves: Sequence[FloatArray]) -> list[FloatArray]:
    """Rates of temperature, and of differences from it, by the first harmonic of the angle."""
    names = shared_differences(observations)
    blocks = []
    for o, held in zip(observations, waves):
        rates = [temperature_rate(o), *(temperature_rate(o, name) - temperature_rate(o) for name in names)]
        blocks.append(np.concatenate([held[:, :2] * rate[:, None] for rate in rates], axis=1))
    return blocks


def _share_of_rate(o: Observation) -> FloatArray:
    """The table's rate [100 deg/s], shape (m,)."""
    return np.asarray(o.averaged(o.run.rate) / 100.0)
