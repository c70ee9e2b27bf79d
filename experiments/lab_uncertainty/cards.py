"""Amplitudes and shapes of causes as a diagnosis states them, of effects in the catalogue's own form."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from experiments.lab_uncertainty.measure import Told, coverage, of_errors
from fogml.arrays import FloatArray
from fogml.gap.cards import card_of
from fogml.gap.field import Field
from fogml.gap.inference import foreseen
from fogml.gap.model import TwinModel
from fogml.gap.settings import STANDARD
from fogml.gap.shapes import is_line, is_whole
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel
from fogml.twin.effect import Effect, NoiseEffect
from fogml.twin.twin_file import load_twin

ROW_S = 20.0
D_PRIME = 30.0
"""Whitened length of an effect beside the constants."""
CASES = {"table at rest": False, "table that turns": True}


def field_of(turns: bool) -> Field:
    """Two runs of ten hours, cycles of 60 degC in 5 and in 7 h, with all that effects are driven by."""
    time = np.arange(0.0, 36000.0, ROW_S)
    runs = []
    for name, hours in (("a", 5.0), ("b", 7.0)):
        phase = 2.0 * np.pi * time / (3600.0 * hours)
        temperature = 10.0 + 30.0 * np.sin(phase)
        angle = 90.0 * np.floor(time / 3600.0) * turns
        turn, moved = np.radians(angle), np.gradient(angle, time)
        runs.append(
            Run.from_columns(
                name,
                time=time,
                gyro=np.zeros(len(time)),
                T_in=temperature,
                T_out=temperature + 0.5 * np.cos(phase) + 0.3 * np.sin(3.0 * phase),
                T_electronics=temperature + 6.0 - 4.0 * np.exp(-time / 2000.0),
                rate=moved,
                angle=angle,
                B_x=20.0 * np.cos(turn),
                B_y=-20.0 * np.sin(turn),
                B_z=-40.0 + 5.0 * np.sin(2.0 * phase),
                supply=12.0 + 0.05 * np.sin(1.3 * phase),
            )
        )
    noise = NoiseModel(0.005, 0.01, 0.005)
    return foreseen(TwinModel(load_twin("tactical")), runs, noise, STANDARD).field


def measured(case: str, repeats: int, seed: int) -> list[dict[str, Any]]:
    """Rows of one case: all effects together, and those alone whose intervals hold too little."""
    field = field_of(CASES[case])
    by_effect = {e.id: list(_told(e, field, repeats, seed)) for e in _effects(field)}
    held = {id: told for id, told in by_effect.items() if told}
    amplitudes = {id: [size for size, _ in told] for id, told in held.items()}
    rows = [
        coverage(
            case, f"amplitudes of {len(held)} effects", [x for told in amplitudes.values() for x in told]
        ),
        coverage(
            case,
            "their shapes' parameters",
            [x for told in held.values() for _, shape in told for x in shape],
        ),
    ]
    alone = [coverage(case, f"amplitude of {id}", told) for id, told in amplitudes.items()]
    return rows + [row for row in alone if row["wilson95"][1] < 0.9]


def _effects(field: Field) -> list[Effect]:
    """Effects of one amplitude on all runs; no noise, and no steps of sensors, which are read off."""
    return [
        declared
        for declared in field.setting.scene.candidates.values()
        if not isinstance(declared, NoiseEffect)
        and not declared.drawn_per_run
        and declared.family not in ("line", "power_cycles", "sensor_steps")
    ]


def _told(declared: Effect, field: Field, repeats: int, seed: int) -> Iterator[tuple[Told, list[Told]]]:
    """Errors of the amplitude and of the shape's parameters, of shapes drawn from the catalogue's priors."""
    scene = field.setting.scene
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat, *declared.id.encode()])
        shape = {
            q.name: float(rng.uniform(0.0, 360.0)) if q.all_round else q.draw(rng, scene.grade)
            for q in declared.shape
        }
        shape |= {q.name: float(round(shape[q.name])) for q in declared.shape if is_whole(q, scene.grids)}
        _, usual = declared.amplitude.range(scene.grade)
        length = field.base.length(field.made(declared, usual, shape))
        size = usual * D_PRIME / max(length, 1e-300)
        greatest = declared.amplitude.limits[1] if declared.in_proportion else usual
        if not length > 1.0 or size > greatest:
            continue  # no run of these shows it at a size of its card, or a possible one
        sign = float(rng.choice((-1.0, 1.0))) if declared.amplitude.signed else 1.0
        made = field.made(declared, sign * size, shape)
        noise: FloatArray = rng.standard_normal(len(made))
        # A family tells the line that stands out.
        lines = {
            "period" if "period" in q.name else "frequency": shape[q.name]
            for q in declared.shape
            if is_line(q)
        }
        card = card_of(declared.id, field, replace(field.base, data=made + noise), lines)
        # (A, phi) and (-A, phi + 180 deg) are one where all turns.
        turned = any(q.all_round for q in declared.shape) and sign * card.value.amplitude < 0.0
        errors = []
        for quantity in declared.shape:
            off = card.value.shape[quantity.name] - shape[quantity.name]
            if quantity.all_round:
                off = (off + 180.0 * turned + 180.0) % 360.0 - 180.0
            if not is_whole(quantity, scene.grids):
                errors.append(of_errors(off, card.shape_se[quantity.name]))
        amplitude = -card.value.amplitude if turned else card.value.amplitude
        yield of_errors(amplitude - sign * size, card.amplitude_se), errors
