"""A laboratory's own simulator in the twin's place: any `fogml.gap.model.GyroModel`.

It replays runs and says how its constants act; what its candidates are is told by the catalogue's family of
that id, or else by the responses that it gives over a grid of their shapes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from fogml.gap.model import AnyModel, Candidate, EffectValue, GyroModel, ModelOnRun, TwinModel
from fogml.runs.run import FloatArray, Run
from fogml.twin.effect import Effect
from fogml.twin.inputs import Inputs
from fogml.twin.registry import effects
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin


class OwnEffect(Effect):
    """A candidate of a model, with what families ask of the catalogue's effects."""

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Not known apart from a run: see `OwnOnRun.response`."""
        raise TypeError(f"{self.id}: the model itself responds, on its runs")


@dataclass(frozen=True, eq=False)
class OwnOnRun:
    """A model with a run's inputs, its temperatures smooth.

    Attributes
    ----------
    model
        The simulator.
    run
        As it is replayed.
    step_degc
        Temperatures are moved by so much, up and down, for the slope of a replay.
    slopes_at
        Slopes that were worked out, by the constants.
    """

    model: GyroModel
    run: Run
    step_degc: float
    slopes_at: dict[tuple[float, ...], dict[str, FloatArray]] = field(default_factory=dict)

    @cached_property
    def on(self) -> ModelOnRun:
        """The model on the run."""
        return self.model.on(self.run)

    def output(self, constants: Mapping[str, float]) -> FloatArray:
        """The replay [deg/h], shape (n,)."""
        return np.asarray(self.on.output(constants), dtype=np.float64)

    def slopes(self, constants: Mapping[str, float]) -> dict[str, FloatArray]:
        """Change of the replay with each recorded temperature [deg/h/degC], shape (n,) each.

        By central differences, all of a run's temperature moved at once: a response to its rate has none.
        """
        key = tuple(constants.values())
        if key not in self.slopes_at:
            groups = {name: self.run.sensors(name) for name in ("T", "T_in", "T_out")}
            if groups["T_in"] == groups["T"]:
                del groups["T_in"]
            self.slopes_at[key] = {n: self._slope(held, constants) for n, held in groups.items() if held}
        return self.slopes_at[key]

    def _slope(self, sensors: Sequence[str], constants: Mapping[str, float]) -> FloatArray:
        up, down = (
            self.model.on(
                self.run.with_columns(**{name: self.run.columns[name] + step for name in sensors})
            ).output(constants)
            for step in (self.step_degc, -self.step_degc)
        )
        return np.asarray((np.asarray(up) - np.asarray(down)) / (2.0 * self.step_degc), dtype=np.float64)

    def columns(self) -> FloatArray:
        """Response to a unit of each constant, shape (n, c); 0 where the run can't show one."""
        told, none = self.on.columns(), np.zeros(len(self.run))
        return np.column_stack([told.get(c.name, none) for c in self.model.constants])

    def nuisances(self, constants: Mapping[str, float]) -> Mapping[str, FloatArray]:
        """What is always a little off, one standard deviation of each [deg/h], shape (n,)."""
        return self.on.nuisances(constants)

    def response(self, id: str, shape: Mapping[str, float], constants: Mapping[str, float]) -> FloatArray:
        """Of a candidate, per unit of its amplitude [deg/h], shape (n,)."""
        return np.asarray(self.on.response(id, shape, constants), dtype=np.float64)

    def changed(
        self, id: str, shape: Mapping[str, float], amplitude: float, constants: Mapping[str, float]
    ) -> FloatArray:
        """What a candidate makes of the output at an amplitude [deg/h], shape (n,)."""
        value = EffectValue(id, amplitude, shape)
        return np.asarray(self.on.output(constants, (value,))) - self.output(constants)


def candidates_of(model: AnyModel) -> dict[str, Effect]:
    """What may be named: a model's own candidates, or the catalogue's where it offers none.

    A candidate that bears an id of the catalogue's has that one's family, and its own sizes.
    """
    catalogue = {id: declared for id, declared in effects().items() if declared.candidate}
    if isinstance(model, TwinModel):
        return {id: declared for id, declared in catalogue.items() if id not in model.lacks}
    offered = dict(model.candidates())
    return {id: _declared(c, catalogue.get(id)) for id, c in offered.items()} if offered else catalogue


def _declared(candidate: Candidate, alike: Effect | None) -> Effect:
    """A candidate as an effect; `alike` is the catalogue's of its id."""
    if candidate is alike:
        return candidate
    told: dict[str, Any] = {
        name: getattr(candidate, name, {} if name == "confused_with" else ())
        for name in ("id", "title", "stage", "amplitude", "shape", "confused_with")
    }
    told |= {
        "drawn_per_run": bool(getattr(candidate, "drawn_per_run", False)),
        "told_by": tuple(getattr(candidate, "told_by", ())),
        "amplitudes": tuple(getattr(candidate, "amplitudes", ())),
        "family": alike.family if alike else "signature",
        "place": getattr(candidate, "place", alike.place if alike else ""),
    }
    return type("Own", (OwnEffect,), told)()


def plant_of(model: AnyModel) -> Twin:
    """The twin whose plant tells temperatures that were not recorded: the model's, or the nominal one."""
    if isinstance(model, TwinModel):
        return model.twin
    return load_twin("nominal")
