"""The programme that shows effects which the runs so far could not show at their usual size."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fogml.arrays import FloatArray
from fogml.gap.model import EffectValue
from fogml.gap.planning.fisher import stated_or_usual
from fogml.gap.planning.programme_design import Design
from fogml.gap.planning.programme_family import Family
from fogml.gap.planning.programme_search import finely, search
from fogml.gap.planning.rehearsal import COARSE_S, FINE_S, Rehearsal, stage
from fogml.gap.planning.separating import LEAST_DISTANCE, run_of
from fogml.gap.result import SeparatingRun
from fogml.gap.rows import at_amplitude
from fogml.runs.facts import Facts
from fogml.signals.noise_model import NoiseModel
from fogml.twin.effect import Effect, NoiseEffect
from fogml.twin.registry import effect
from fogml.twin.twin import Twin

MOST_PROGRAMMES = 80
"""Of 240, three draws of 18 effects gained 1 to 3 % of the lengths over 80, in twice the time and more."""
HARDLY = 0.3
"""Length from which getting longer counts in a search."""
PLENTY = 2.0 * LEAST_DISTANCE
"""Length from which getting longer does not count any more."""


def showing_run(
    twin: Twin,
    noise: NoiseModel,
    constants: Mapping[str, float],
    ids: Sequence[str],
    *,
    hours: float = 24.0,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
    facts: Facts | None = None,
    most: int = MOST_PROGRAMMES,
) -> SeparatingRun | None:
    """The programme that shows as many effects as it can at their usual size.

    Parameters
    ----------
    twin, noise, constants, hours, seed, progress, facts, most
        As in `fogml.gap.planning.separating.separating_run`.
    ids
        The effects. Those that a record itself tells, such as the steps of its sensors, no programme shows
        any better: they are left out.

    Returns
    -------
    SeparatingRun or None
        ``separates`` are the effects that reach a whitened length of `LEAST_DISTANCE` beside the constants,
        ``distance`` is the least of theirs. None where no effect does.
    """
    on = stage(twin, noise, constants, facts=facts)
    family = Family(hours, (-40.0, 60.0), ("up", "north") if facts is None else (None,), True)
    usual = [stated_or_usual(on, effect(id)) for id in ids if _may_show(effect(id))]
    if not usual:
        return None

    def merit(design: Design, sample_s: float = COARSE_S) -> float:
        held = lengths(Rehearsal(on, family, design, sample_s), usual)
        return float(np.mean(np.log(np.clip(held, HARDLY, PLENTY))))

    tried = search(family, merit, seed=seed, most=most, progress=progress)
    finals = finely(tried, lambda design: merit(design, FINE_S))
    reached = lengths(Rehearsal(on, family, finals[0].design, FINE_S), usual)
    shown = [(value.id, length) for value, length in zip(usual, reached) if length >= LEAST_DISTANCE]
    if not shown:
        return None
    least = float(min(length for _, length in shown))
    run = run_of(family, finals[:1], [id for id, _ in shown], least, "showing-run")
    return replace(run, aim="show")


def _may_show(declared: Effect) -> bool:
    """Whether a programme may show it: not the steps of a record, nor a random error."""
    if isinstance(declared, NoiseEffect):
        return declared.steady
    return not declared.digitises


def lengths(rehearsal: Rehearsal, values: Sequence[EffectValue]) -> FloatArray:
    """Whitened length of each effect beside the constants, shape (k,)."""
    shapes = [at_amplitude(effect(v.id), v.amplitude, v.shape) for v in values]
    made = [v.amplitude * rehearsal.white(v.id, [shape]) for v, shape in zip(values, shapes)]
    columns = np.concatenate(made, axis=1)
    return np.asarray(np.sqrt(np.maximum(np.diagonal(rehearsal.beside(columns)), 0.0)))
