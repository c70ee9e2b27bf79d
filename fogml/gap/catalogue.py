"""Whose family is which: the catalogue's effects by what they declare, the unknown, other plants."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from fogml.gap import other_families as other
from fogml.gap import thermal_families as thermal
from fogml.gap import turning_families as turning
from fogml.gap.scene import Build, Family, Scene, steps_are_coarse
from fogml.gap.unknown import unknown_families
from fogml.twin.effect import Effect, NoiseEffect
from fogml.twin.twin import Twin

FAMILIES: dict[str, Build] = {
    "loops": thermal.hysteresis,
    "scale_factor_loops": thermal.scale_factor_hysteresis,
    "warm_up": thermal.warm_up,
    "wave": thermal.polarization,
    "transition": thermal.transition,
    "hidden_node": thermal.hidden_node,
    "relaxation": thermal.relaxation,
    "rate_product": thermal.rate_product,
    "rate": thermal.rate_of_temperature,
    "gradient_rate": thermal.shupe,
    "static": thermal.static,
    "ageing": thermal.ageing,
    "machines": other.machines,
    "line": other.lines,
    "supply": other.supply,
    "power_cycles": other.power_cycles,
    "sensor_lag": other.sensor_lag,
    "sensor_placement": other.sensor_placement,
    "sensor_steps": other.sensor_steps,
    "clock_skew": other.clock_skew,
    "scale_factor_node": turning.scale_factor_node,
    "modulator": turning.modulator,
    "even_in_rate": turning.even_in_rate,
    "odd_in_rate": turning.odd_in_rate,
    "vibration": turning.vibration,
    "leads": turning.leads,
    "moisture": other.moisture,
}
"""Families by the names that effects declare; an effect of family ``signature`` has its own signature's."""


def families_of(twin: Twin, scene: Scene, without: Iterable[str] = ()) -> tuple[Family, ...]:
    """Families of everything that may act on these runs.

    `twin` tells how sensors usually read. Effects that the twin has are among them: their sizes may be wrong.
    """
    left_out = set(without)
    known = [
        _known(declared, "left_out" if id in left_out else "known")
        for id, declared in scene.candidates.items()
        if _can_show(declared, scene, twin)
    ]
    return (*known, *unknown_families(), Family("other_plant", "plant", other.other_plant))


def _known(declared: Effect, kind: Literal["known", "left_out"]) -> Family:
    build = FAMILIES.get(declared.family) or other.signature_of(declared)
    return Family(
        declared.id,
        kind,
        build,
        drawn_per_run=declared.drawn_per_run or declared.family == "line",
        place=declared.place,
    )


def _can_show(declared: Effect, scene: Scene, twin: Twin) -> bool:
    """Whether the runs hold what tells an effect, if it says what that is."""
    if isinstance(declared, NoiseEffect) and not declared.steady and declared.family == "signature":
        return False
    if declared.family == "sensor_steps":
        return steps_are_coarse(scene, twin)
    if declared.family == "machines":
        return True
    runs = scene.runs[: scene.fitted]
    return all(
        any(
            name in r.run.columns and float(abs(r.run.columns[name] - r.run.columns[name][0]).max()) > 0.0
            for name in group
            for r in runs
        )
        for group in declared.told_by
    )
