"""The twin: constants of one gyro, its thermal plant, sensors and surroundings, effects that are on.

What is not known of it stands in a twin file as::

    uncertainty:
      source: diagnosis of a.csv and b.csv
      parameters: [nominal.b0, effects.thermal_hysteresis.amplitude, plant.case]
      covariance: [[1.0e-4, ...], ...]     # in the units in which the file states them
    suspected:
      glass_transition: {probability: 0.3, amplitude: {value: 0.1, unit: deg/h}, ...}
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fogml.errors import InputError, known_are, quoted
from fogml.frozen import FrozenMappings
from fogml.twin.coil import LayeredCoil
from fogml.twin.effect import Effect, LoggerEffect, NoiseEffect, SensorEffect, ThermalEffect
from fogml.twin.noise import NoiseConstants
from fogml.twin.nominal import PRIOR_SD, QUANTITIES, NominalConstants
from fogml.twin.optics import REFERENCE_COIL, Coil, Light, Receiver
from fogml.twin.plant.coil import END_NODES, CoilEnds, with_ends
from fogml.twin.plant.network import ThermalNetwork
from fogml.twin.quantities import GRADES, Grade, check_all, limited
from fogml.twin.registry import catalogue_order, effect
from fogml.twin.set_up import Plant, Sensors, Surroundings
from fogml.twin.uncertainty import Suspected, Uncertainty

if TYPE_CHECKING:
    from fogml.runs.facts import Facts
    from fogml.runs.run import Run
    from fogml.twin.programme import Programme
    from fogml.twin.simulate import Simulation
    from fogml.twin.truth import Truth


RATE_WINDOW_S = 64.0
"""Window before and after a recorded sample that its rates are taken over [s]."""
NOISE_FACTOR = 3.0
"""Factor of the log-normal priors of N, B and K where no noise run is given."""


@dataclass(frozen=True)
class EffectSetting(FrozenMappings):
    """An effect that is on: its amplitude and its shape parameters, in the card's units."""

    amplitude: float
    shape: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "shape", MappingProxyType(dict(self.shape)))

    @property
    def key(self) -> tuple[tuple[str, float], ...]:
        """The shape as a hashable value."""
        return tuple(sorted(self.shape.items()))


@dataclass(frozen=True, eq=False)
class Twin(FrozenMappings):
    """A gyro in its chamber, as a simulator. Immutable; ``with_...`` gives a changed one.

    Attributes
    ----------
    name, description
        For reports.
    grade
        Whose ranges hold where something is drawn from a prior.
    nominal
        Constants of the nominal gyro.
    nominal_sd
        Standard deviations of the priors about them.
    noise
        Coefficients of the noise terms.
    noise_factor
        Factor of each coefficient's log-normal prior; 1 for one that is known.
    coil
        Its fibre coil, from which winding, leads, fringes, photon noise and proper frequency follow.
    receiver
        What detects its light.
    plant, sensors, surroundings
        The rest of the set-up.
    settings
        Id of each effect that is on to its amplitude and shape.
    uncertainty
        Covariance of its parameters, where a diagnosis told it.
    suspected
        Id of each effect that may act and is not on, with its probability.

    Raises
    ------
    InputError
        For an unknown effect or shape parameter, a value that is not physical, or two effects that
        can't be on at the same time.
    """

    name: str = "twin"
    description: str = ""
    grade: Grade = "tactical"
    nominal: NominalConstants = field(default_factory=NominalConstants)
    nominal_sd: NominalConstants = PRIOR_SD
    noise: NoiseConstants = field(default_factory=NoiseConstants)
    noise_factor: Mapping[str, float] = field(default_factory=dict)
    coil: Coil = REFERENCE_COIL
    receiver: Receiver = field(default_factory=Receiver)
    plant: Plant = field(default_factory=Plant)
    sensors: Sensors = field(default_factory=Sensors)
    surroundings: Surroundings = field(default_factory=Surroundings)
    settings: Mapping[str, EffectSetting] = field(default_factory=dict)
    uncertainty: Uncertainty | None = None
    suspected: Mapping[str, Suspected] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # Raises where layers and winding don't fit together.
        LayeredCoil(self.coil)
        if self.grade not in GRADES:
            raise InputError(f"grade is {quoted(self.grade)}; known are {', '.join(GRADES)}")
        check_all(self.nominal, QUANTITIES, "nominal")
        for name, deviation in vars(self.nominal_sd).items():
            if deviation < 0.0:
                raise InputError(f"nominal: 'sd' of '{name}' is {deviation:g}; 0 or more is needed")
        settings = {}
        for id, setting in self.settings.items():
            declared = effect(id)
            amplitude, shape = declared.checked({"amplitude": setting.amplitude, **setting.shape})
            settings[id] = EffectSetting(amplitude, shape)
            for other in declared.conflicts:
                if other in self.settings:
                    raise InputError(f"effects '{id}' and '{other}' can't be on at the same time; remove one")
        ordered = dict(sorted(settings.items(), key=lambda item: catalogue_order(effect(item[0]))))
        object.__setattr__(self, "settings", MappingProxyType(ordered))
        suspected = {}
        for id, held in self.suspected.items():
            given = effect(id).checked({"amplitude": held.amplitude, **held.shape})
            suspected[id] = Suspected(held.probability, *given)
            if id in self.settings:
                raise InputError(f"effect '{id}' is on and suspected; it is one of the two")
        object.__setattr__(self, "suspected", MappingProxyType(suspected))
        factors = dict.fromkeys(("N", "B", "K"), NOISE_FACTOR) | dict(self.noise_factor)
        for name, factor in factors.items():
            if name not in vars(self.noise):
                raise InputError(f"noise: 'factor' of {known_are(name, vars(self.noise), 'terms')}")
            limited("factor", "1", 1.0, math.inf).check(factor, f"noise: '{name}'")
        object.__setattr__(self, "noise_factor", MappingProxyType(factors))

    def __repr__(self) -> str:
        return f"Twin({self.name!r}, {len(self.settings)} effects)"

    @cached_property
    def on(self) -> tuple[tuple[Effect, EffectSetting], ...]:
        """The effects that are on, in the order of the catalogue, with their settings."""
        return tuple((effect(id), setting) for id, setting in self.settings.items())

    @cached_property
    def thermal(self) -> tuple[tuple[ThermalEffect, EffectSetting], ...]:
        """Those that change chamber or plant."""
        return tuple((d, s) for d, s in self.on if isinstance(d, ThermalEffect))

    @cached_property
    def falsifying(self) -> tuple[tuple[SensorEffect, EffectSetting], ...]:
        """Those that falsify measured temperatures."""
        return tuple((d, s) for d, s in self.on if isinstance(d, SensorEffect))

    @cached_property
    def logging(self) -> tuple[tuple[LoggerEffect, EffectSetting], ...]:
        """Those of the logger."""
        return tuple((d, s) for d, s in self.on if isinstance(d, LoggerEffect))

    @cached_property
    def random(self) -> tuple[tuple[NoiseEffect, EffectSetting], ...]:
        """Random errors beside `noise`."""
        return tuple((d, s) for d, s in self.on if isinstance(d, NoiseEffect) and not d.steady)

    @cached_property
    def light(self) -> Light:
        """The light at its receiver, with the course that the effect ``light_power`` gives it."""
        course = self.settings.get("light_power")
        return Light(self.receiver) if course is None else Light(self.receiver, **course.shape)

    @property
    def notes(self) -> tuple[str, ...]:
        """What of its noise does not go together as one may think, in sentences."""
        if not self.noise.N:
            return ()
        stated = f"noise: N = {self.noise.N:g} deg/sqrt(h)"
        if "arw_physics" in self.settings:
            return (
                f"{stated} comes on top of the photon noise of 'arw_physics'; state N: 0 for that alone.",
            )
        if "light_power" in self.settings:
            return (
                f"{stated} stays as it is where 'light_power' takes light away; the effect 'arw_physics' in "
                "its place goes with the light.",
            )
        return ()

    @cached_property
    def network(self) -> ThermalNetwork:
        """The thermal plant with the effects that change it, and with the coil's ends if they are needed."""
        network = self.plant.network
        asked = any(END_NODES & set(declared.needs) for declared, _ in self.on)
        if asked and self.plant.ends is None:
            network = with_ends(network, CoilEnds())
        for declared, setting in self.thermal:
            network = declared.change_plant(network, setting.amplitude, **setting.shape)
        return network

    def counts_per_deg_h(self, sample_s: float) -> float | None:
        """Scale factor of an output in counts a sample of this length [s]; None for one in deg/h."""
        counting = self.settings.get("output_counts")
        # One deg/h is one arcsec per second.
        return sample_s / counting.amplitude if counting is not None and counting.amplitude else None

    def with_effect(self, id: str, amplitude: float | None = None, /, **shape: float) -> Twin:
        """The twin with an effect on, or changed.

        Parameters
        ----------
        id
            The effect.
        amplitude
            In the card's unit; if not given the one that is set, else the middle of the grade's range.
        shape
            Shape parameters; others stay, or take the middle of the grade's range.
        """
        declared, before = effect(id), self.settings.get(id)
        if amplitude is None:
            amplitude = before.amplitude if before else declared.amplitude.typical(self.grade)
        held = before.shape if before else declared.default_shape(self.grade)
        setting = EffectSetting(amplitude, {**held, **shape})
        suspected = {other: told for other, told in self.suspected.items() if other != id}
        return replace(self, settings={**self.settings, id: setting}, suspected=suspected)

    def without_effect(self, *ids: str) -> Twin:
        """The twin with effects off.

        Raises
        ------
        InputError
            If one is not on.
        """
        for id in ids:
            if id not in self.settings:
                on = ", ".join(self.settings) or "none"
                raise InputError(f"twin '{self.name}': effect '{id}' is not on; on are {on}")
        left = {k: v for k, v in self.settings.items() if k not in ids}
        known = self.uncertainty and self.uncertainty.without(*(f"effects.{id}." for id in ids))
        return replace(self, settings=left, uncertainty=known)

    def with_nominal(self, **constants: float) -> Twin:
        """The twin with nominal constants changed."""
        return replace(self, nominal=replace(self.nominal, **constants))

    def with_noise(self, **coefficients: float) -> Twin:
        """The twin with noise coefficients changed."""
        return replace(self, noise=replace(self.noise, **coefficients))

    def named(self, name: str) -> Twin:
        """The same twin under another name."""
        return replace(self, name=name)

    def simulate(
        self,
        programme: Programme | str,
        *,
        sample_s: float = 1.0,
        seed: int = 0,
        facts: Facts | None = None,
        truth: bool = False,
        **more: Any,
    ) -> Simulation:
        """A synthetic run; see `fogml.twin.simulate.simulate`."""
        from fogml.twin.simulate import simulate

        return simulate(programme, self, sample_s=sample_s, seed=seed, facts=facts, truth=truth, **more)

    def replay(self, run: Run, *, only: str | None = None, truth: Truth | None = None) -> Any:
        """Output for a run's inputs [deg/h], shape (n,); see `fogml.twin.replay.replay`."""
        from fogml.twin.replay import replay

        return replay(self, run, only=only, truth=truth)
