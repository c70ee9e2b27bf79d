"""The twin: constants of one gyro, its thermal plant, sensors and surroundings, and effects that are on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fogml.errors import InputError
from fogml.runs.columns import coil_sensor_number
from fogml.twin.effect import Effect, LoggerEffect, NoiseEffect, SensorEffect, ThermalEffect
from fogml.twin.noise import NoiseConstants
from fogml.twin.nominal import PRIOR_SD, NominalConstants
from fogml.twin.plant.air import Airflow
from fogml.twin.plant.line import RadialLine, with_line
from fogml.twin.plant.network import ThermalNetwork
from fogml.twin.plant.power import SelfHeating
from fogml.twin.plant.standard import ThermalConstants, standard_network
from fogml.twin.quantities import Grade, Quantity
from fogml.twin.registry import effect, effects

if TYPE_CHECKING:
    from fogml.runs.facts import Facts
    from fogml.runs.run import Run
    from fogml.twin.programme import Programme
    from fogml.twin.simulate import Simulation
    from fogml.twin.truth import Truth

RATE_WINDOW_S = 64.0
"""Window of the temperature rates that effects are defined with [s]."""
NOISE_FACTOR = 3.0
"""Factor of the log-normal priors of N, B and K where no noise run is given."""


@dataclass(frozen=True)
class EffectSetting:
    """An effect that is on: its amplitude and its shape parameters, in the card's units."""

    amplitude: float
    shape: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "shape", MappingProxyType(dict(self.shape)))

    @property
    def key(self) -> tuple[tuple[str, float], ...]:
        """The shape as a hashable value."""
        return tuple(sorted(self.shape.items()))


@dataclass(frozen=True)
class Plant:
    """The thermal plant of a twin.

    Attributes
    ----------
    constants
        Time constants and heat capacities.
    order
        Number of nodes, as `standard_network` has it.
    heating
        Heat of the electronics from power-on.
    airflow
        How the air's conductance follows fan and table rate.
    line
        A radial conduction line in place of the coil's nodes, if there is to be one.
    """

    constants: ThermalConstants = field(default_factory=ThermalConstants)
    order: int = 6
    heating: SelfHeating = field(default_factory=SelfHeating)
    airflow: Airflow = field(default_factory=Airflow)
    line: RadialLine | None = None

    @cached_property
    def network(self) -> ThermalNetwork:
        """The plant as a network."""
        network = replace(
            standard_network(self.constants, self.order), heating=self.heating, airflow=self.airflow
        )
        return network if self.line is None else with_line(network, self.line)


SENSOR_QUANTITIES: tuple[Quantity, ...] = (
    Quantity("noise", "degC", (0.005, 0.05), (0.001, 0.01), "standard deviation of a sample", (0.0, 100.0)),
    Quantity("resolution", "degC", (0.01, 0.0625), (0.001, 0.01), "last digit", (0.0, 100.0)),
    Quantity("lag", "s", (5.0, 60.0), (1.0, 20.0), "time constant", (0.0, 1e5)),
)


@dataclass(frozen=True)
class SensorErrors:
    """Stated errors of a temperature sensor, of all alike where nothing else is said.

    Attributes
    ----------
    noise
        Standard deviation of a sample [degC].
    resolution
        Last digit [degC].
    lag
        Time constant behind its place [s].
    reads
        Place to weight, adding to 1, for a sensor that sits between nodes; empty for the node of
        its name.
    """

    noise: float = 0.0
    resolution: float = 0.0
    lag: float = 0.0
    reads: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for quantity in SENSOR_QUANTITIES:
            quantity.check(getattr(self, quantity.name), "sensor")
        if self.reads and abs(sum(self.reads.values()) - 1.0) > 1e-9:
            raise InputError(f"sensor: weights of 'reads' add to {sum(self.reads.values()):g}; 1 is needed")


@dataclass(frozen=True)
class Sensors:
    """Errors of all temperature sensors, and of single ones that differ."""

    common: SensorErrors = field(default_factory=SensorErrors)
    single: Mapping[str, SensorErrors] = field(default_factory=dict)

    def of(self, name: str) -> SensorErrors:
        """Errors of the sensor behind a column."""
        return self.single.get(name, self.common)

    def place(self, name: str) -> Mapping[str, float]:
        """Nodes, with weights, that the sensor behind a column reads.

        Coil sensors ``T1``, ``T2`` ... sit in turn on the inner and the outer face unless stated.
        """
        number = coil_sensor_number(name)
        if number is None or self.of(name).reads:
            return self.of(name).reads or {name: 1.0}
        return {"T_in" if number % 2 else "T_out": 1.0}


SURROUNDING_QUANTITIES: tuple[Quantity, ...] = (
    Quantity("supply", "V", (5.0, 28.0), (5.0, 28.0), "supply voltage", (0.0, 1e3)),
    Quantity("vibration", "g", (0.0, 0.01), (0.0, 0.01), "rms with the compressor off", (0.0, 100.0)),
    Quantity("compressor_vibration", "g", (0.0, 0.1), (0.0, 0.1), "rms at full duty, added", (0.0, 100.0)),
    Quantity("horizontal_field", "uT", (15.0, 30.0), (15.0, 30.0), "magnetic, northward", (0.0, 1e6)),
    Quantity("vertical_field", "uT", (30.0, 55.0), (30.0, 55.0), "magnetic, upward", (-1e6, 1e6)),
)


@dataclass(frozen=True)
class Surroundings:
    """What acts on the unit from outside beside heat: supply [V], vibration [g], magnetic field [uT]."""

    supply: float = 28.0
    vibration: float = 0.0
    compressor_vibration: float = 0.0
    horizontal_field: float = 20.0
    vertical_field: float = 40.0

    def __post_init__(self) -> None:
        for quantity in SURROUNDING_QUANTITIES:
            quantity.check(getattr(self, quantity.name), "surroundings")


@dataclass(frozen=True, eq=False)
class Twin:
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
    plant, sensors, surroundings
        The rest of the set-up.
    settings
        Id of each effect that is on to its amplitude and shape.

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
    plant: Plant = field(default_factory=Plant)
    sensors: Sensors = field(default_factory=Sensors)
    surroundings: Surroundings = field(default_factory=Surroundings)
    settings: Mapping[str, EffectSetting] = field(default_factory=dict)

    def __post_init__(self) -> None:
        settings = {}
        for id, setting in self.settings.items():
            declared = effect(id)
            amplitude, shape = declared.checked({"amplitude": setting.amplitude, **setting.shape})
            settings[id] = EffectSetting(amplitude, shape)
            for other in declared.conflicts:
                if other in self.settings:
                    raise InputError(f"effects '{id}' and '{other}' can't be on at the same time; remove one")
        order = {id: place for place, id in enumerate(effects())}
        ordered = dict(sorted(settings.items(), key=lambda item: order[item[0]]))
        object.__setattr__(self, "settings", MappingProxyType(ordered))
        factors = dict.fromkeys(("N", "B", "K"), NOISE_FACTOR) | dict(self.noise_factor)
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
        return tuple((d, s) for d, s in self.on if isinstance(d, NoiseEffect))

    @cached_property
    def network(self) -> ThermalNetwork:
        """The plant as a network."""
        network = replace(
            standard_network(self.constants, self.order), heating=self.heating, airflow=self.airflow
        )
        return network if self.line is None else with_line(network, self.line)


SENSOR_QUANTITIES: tuple[Quantity, ...] = (
    Quantity("noise", "degC", (0.005, 0.05), (0.001, 0.01), "standard deviation of a sample", (0.0, 100.0)),
    Quantity("resolution", "degC", (0.01, 0.0625), (0.001, 0.01), "last digit", (0.0, 100.0)),
    Quantity("lag", "s", (5.0, 60.0), (1.0, 20.0), "time constant", (0.0, 1e5)),
)


@dataclass(frozen=True)
class SensorErrors:
    """Stated errors of a temperature sensor, of all alike where nothing else is said.

    Attributes
    ----------
    noise
        Standard deviation of a sample [degC].
    resolution
        Last digit [degC].
    lag
        Time constant behind its place [s].
    reads
        Place to weight, adding to 1, for a sensor that sits between nodes; empty for the node of
        its name.
    """

    noise: float = 0.0
    resolution: float = 0.0
    lag: float = 0.0
    reads: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for quantity in SENSOR_QUANTITIES:
            quantity.check(getattr(self, quantity.name), "sensor")
        if self.reads and abs(sum(self.reads.values()) - 1.0) > 1e-9:
            raise InputError(f"sensor: weights of 'reads' add to {sum(self.reads.values()):g}; 1 is needed")


@dataclass(frozen=True)
class Sensors:
    """Errors of all temperature sensors, and of single ones that differ."""

    common: SensorErrors = field(default_factory=SensorErrors)
    single: Mapping[str, SensorErrors] = field(default_factory=dict)

    def of(self, name: str) -> SensorErrors:
        """Errors of the sensor behind a column."""
        return self.single.get(name, self.common)

    def place(self, name: str) -> Mapping[str, float]:
        """Nodes, with weights, that the sensor behind a column reads.

        Coil sensors ``T1``, ``T2`` ... sit in turn on the inner and the outer face unless stated.
        """
        number = coil_sensor_number(name)
        if number is None or self.of(name).reads:
            return self.of(name).reads or {name: 1.0}
        return {"T_in" if number % 2 else "T_out": 1.0}


SURROUNDING_QUANTITIES: tuple[Quantity, ...] = (
    Quantity("supply", "V", (5.0, 28.0), (5.0, 28.0), "supply voltage", (0.0, 1e3)),
    Quantity("vibration", "g", (0.0, 0.01), (0.0, 0.01), "rms with the compressor off", (0.0, 100.0)),
    Quantity("compressor_vibration", "g", (0.0, 0.1), (0.0, 0.1), "rms at full duty, added", (0.0, 100.0)),
    Quantity("horizontal_field", "uT", (15.0, 30.0), (15.0, 30.0), "magnetic, northward", (0.0, 1e6)),
    Quantity("vertical_field", "uT", (30.0, 55.0), (30.0, 55.0), "magnetic, upward", (-1e6, 1e6)),
)


@dataclass(frozen=True)
class Surroundings:
    """What acts on the unit from outside beside heat: supply [V], vibration [g], magnetic field [uT]."""

    supply: float = 28.0
    vibration: float = 0.0
    compressor_vibration: float = 0.0
    horizontal_field: float = 20.0
    vertical_field: float = 40.0

    def __post_init__(self) -> None:
        for quantity in SURROUNDING_QUANTITIES:
            quantity.check(getattr(self, quantity.name), "surroundings")


@dataclass(frozen=True, eq=False)
class Twin:
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
    plant, sensors, surroundings
        The rest of the set-up.
    settings
        Id of each effect that is on to its amplitude and shape.

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
    plant: Plant = field(default_factory=Plant)
    sensors: Sensors = field(default_factory=Sensors)
    surroundings: Surroundings = field(default_factory=Surroundings)
    settings: Mapping[str, EffectSetting] = field(default_factory=dict)

    def __post_init__(self) -> None:
        settings = {}
        for id, setting in self.settings.items():
            declared = effect(id)
            amplitude, shape = declared.checked({"amplitude": setting.amplitude, **setting.shape})
            settings[id] = EffectSetting(amplitude, shape)
            for other in declared.conflicts:
                if other in self.settings:
                    raise InputError(f"effects '{id}' and '{other}' can't be on at the same time; remove one")
        order = {id: place for place, id in enumerate(effects())}
        ordered = dict(sorted(settings.items(), key=lambda item: order[item[0]]))
        object.__setattr__(self, "settings", MappingProxyType(ordered))
        factors = dict.fromkeys(("N", "B", "K"), NOISE_FACTOR) | dict(self.noise_factor)
        object.__setattr__(self, "noise_factor", MappingProxyType(factors))

    def __repr__(self) -> str:
        return f"Twin({self.name!r}, {len(self.settings)} effects)"

    @cached_property
    def on(self) -> tuple[tuple[Effect, EffectSetting], ...]:
        """The effects that are on, in the order of the catalogue, with their settings."""
        return tuple((effect(id), setting) for id, setting in self.settings.items())

    def stage(self, kind: type[Effect]) -> tuple[tuple[Effect, EffectSetting], ...]:
        """The effects of a kind that are on."""
        return tuple(item for item in self.on if isinstance(item[0], kind))

    @cached_property
    def network(self) -> ThermalNetwork:
        """The thermal plant with the effects that change it."""
        network = self.plant.network
        for declared, setting in self.thermal:
            network = declared.change_plant(network, setting.amplitude, **setting.shape)
        return network

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
        return replace(self, settings={**self.settings, id: setting})

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
        return replace(self, settings={k: v for k, v in self.settings.items() if k not in ids})

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
