"""What a twin's gyro stands in and is watched by: thermal plant, sensors, surroundings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from fogml.errors import InputError
from fogml.runs.columns import KNOWN, coil_sensor_number, is_temperature
from fogml.twin.plant.coil import CoilEnds, RadialLine, with_ends, with_line
from fogml.twin.plant.heat import Airflow, SelfHeating
from fogml.twin.plant.network import ThermalNetwork
from fogml.twin.plant.standard import ORDER, ThermalConstants, standard_network
from fogml.twin.quantities import Quantity, check_all, shared


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
    ends
        Nodes at the coil's top and bottom; if None, usual ones where an effect asks for them.
    """

    constants: ThermalConstants = field(default_factory=ThermalConstants)
    order: int = 6
    heating: SelfHeating = field(default_factory=SelfHeating)
    airflow: Airflow = field(default_factory=Airflow)
    line: RadialLine | None = None
    ends: CoilEnds | None = None

    def __post_init__(self) -> None:
        ORDER.check(self.order, "thermal plant")

    @cached_property
    def network(self) -> ThermalNetwork:
        """The plant as a network."""
        network = replace(
            standard_network(self.constants, self.order), heating=self.heating, airflow=self.airflow
        )
        network = network if self.line is None else with_line(network, self.line)
        return network if self.ends is None else with_ends(network, self.ends)


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
        check_all(self, SENSOR_QUANTITIES, "sensor")
        if self.reads and not abs(sum(self.reads.values()) - 1.0) <= 1e-9:
            raise InputError(f"sensor: weights of 'reads' add to {sum(self.reads.values()):g}; 1 is needed")


@dataclass(frozen=True)
class Sensors:
    """Errors of all temperature sensors, and of single ones that differ."""

    common: SensorErrors = field(default_factory=SensorErrors)
    single: Mapping[str, SensorErrors] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in self.single:
            if not is_temperature(name):
                known = ", ".join(key for key in KNOWN if is_temperature(key)) + " and T1, T2 ..."
                raise InputError(f"key 'sensors.single.{name}' is no temperature's name; known are {known}")

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


EARTH_HORIZONTAL_UT, EARTH_VERTICAL_UT = 20.0, 40.0
"""Sizes of Earth's magnetic field at middle latitudes [uT]."""
SURROUNDING_QUANTITIES: tuple[Quantity, ...] = (
    shared("supply", "V", (5.0, 28.0), "supply voltage", (0.0, 1e3)),
    shared("vibration", "g", (0.0, 0.01), "rms with the compressor off", (0.0, 100.0)),
    shared("compressor_vibration", "g", (0.0, 0.1), "rms of its own, while on", (0.0, 100.0)),
    shared("horizontal_field", "uT", (15.0, 30.0), "magnetic, northward", (0.0, 1e6)),
    shared("vertical_field", "uT", (30.0, 55.0), "magnetic, down in the north, up in the south", (-1e6, 1e6)),
)


@dataclass(frozen=True)
class Surroundings:
    """What acts on the unit from outside beside heat: supply [V], vibration [g], magnetic field [uT]."""

    supply: float = 28.0
    vibration: float = 0.0
    compressor_vibration: float = 0.0
    horizontal_field: float = EARTH_HORIZONTAL_UT
    vertical_field: float = EARTH_VERTICAL_UT

    def __post_init__(self) -> None:
        check_all(self, SURROUNDING_QUANTITIES, "surroundings")
