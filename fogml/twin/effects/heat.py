"""Heat: the chamber's air, the plant, and what no sensor shows of it."""

from __future__ import annotations

from dataclasses import replace

from fogml.arrays import FloatArray
from fogml.twin.effect import ThermalEffect
from fogml.twin.inputs import Inputs
from fogml.twin.plant.network import ThermalNetwork as Network
from fogml.twin.quantities import Quantity, phase, shared, signed, unsigned
from fogml.twin.responses import line


class ThermalNetwork(ThermalEffect):
    """Nodes that take up more heat than stated: every time constant of the plant is another one.

    ::

        (1 + A) C_i dT_i/dt = sum_j G_ij (T_j - T_i) + P_i(t)

    for chamber air, case, coil, hub, electronics and plate (`fogml.twin.plant`). Chamber to case takes 5
    to 30 min, case to coil 2 to 15, outer to inner face 1 to 10, electronics to case 3 to 10 min; A is how
    far those of one unit are off. Sensors show what the nodes do, so that a replay lacks nothing.

    Source: heat equation (derived); ranges are engineering ones.
    """

    code = "A1"
    title = "Time constants of the thermal network"
    amplitude = signed("1", (0.05, 0.5), (0.05, 0.5), "A", 0.9)
    sources = ("Heat equation of a network of nodes",)
    shows = "a low pass and a delay of the chamber's temperature at every sensor"
    confused_with = {
        "airflow": "the fan, or another table rate: capacities don't care",
        "sensor_lag": "a power step: it reaches the sensor from the other side",
        "hidden_thermal_node": "a soak of several hours",
    }
    candidate = False

    def change_plant(self, plant: Network, amplitude: float, **shape: float) -> Network:
        capacities = {name: (1.0 + amplitude) * value for name, value in plant.capacities.items()}
        return replace(plant, capacities=capacities)


class SelfHeating(ThermalEffect):
    """Power that the electronics turn into heat from each power-on.

    ::

        P(t) = P_inf + (P_0 - P_inf) exp(-t / time_constant)

    The amplitude is the electronics' rise in the end [degC], P_inf times what the plant makes of a watt;
    ``initial_ratio`` is P_0 / P_inf. 1.5 to 4 W for a tactical gyro, 4 to 12 W for a navigation one with
    erbium source. It takes the place of any heating that the plant states. Sensors show it, so that a replay
    lacks nothing.

    Source: heat equation (derived); ranges are engineering ones.
    """

    code = "A2"
    title = "Self-heating of the electronics"
    amplitude = unsigned("degC", (5.0, 20.0), (5.0, 20.0), "steady rise", 100.0)
    shape = (
        shared("initial_ratio", "1", (1.0, 2.0), "P_0 / P_inf", (0.0, 20.0)),
        shared("time_constant", "s", (300.0, 2400.0), "of the power", (0.1, 1e6)),
    )
    sources = ("Heat equation of a network of nodes",)
    shows = "an exponential after power-on at constant chamber temperature, from hub to coil"
    confused_with = {
        "warmup_bias": "a sensor on the electronics",
        "ageing": "a power cycle in a soak starts it again",
        "stress_relaxation": "a power cycle in a soak starts it again",
    }
    candidate = False

    def change_plant(self, plant: Network, amplitude: float, **shape: float) -> Network:
        if amplitude == 0.0:
            return plant
        steady = amplitude / plant.steady_rises()[plant.heating.node]
        return plant.with_heating(steady, shape["initial_ratio"] * steady, shape["time_constant"])


class ChamberRipple(ThermalEffect):
    """Air that swings about its set point, and overshoots it at the end of a ramp.

    ::

        T_air = T_set + a (sin(2 pi t / period + phase) + overshoot * o(t))
        o = (lag(dT_set/dt, period) - lag(dT_set/dt, period / 4)) / 0.472

    o rises to 1 per degC/min of a ramp that ends, and fades with the period. a is 0.1 to 1 degC, overshoots
    are 1 to 5 degC. Sensors on the unit show it as far as it reaches them.

    Source: two-term control of a chamber; form and ranges are engineering ones.
    """

    code = "A3"
    title = "Ripple of the chamber"
    amplitude = unsigned("degC", (0.1, 1.0), (0.1, 1.0), "a", 20.0)
    shape = (
        shared("period", "s", (60.0, 600.0), "of the chamber's control", (1.0, 1e5)),
        phase("phase", "at time 0"),
        shared("overshoot", "1/(degC/min)", (1.0, 20.0), "in units of a", (0.0, 1e3)),
    )
    sources = ("Data sheets of climatic chambers",)
    shows = "a narrow line at the chamber's period through rates of temperature, not in slow sensors"
    confused_with = {
        "chamber_pickup": "its delay: pick-up has none",
        "polarization_nonreciprocity": "this one is periodic in time, that one in temperature",
        "sinusoidal": "a sensor in the air: coherent with this one",
    }
    candidate = False

    def change_chamber(
        self, chamber: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        memory, time, period = inputs.memory, inputs.time, shape["period"]
        rate = memory.rate(f"{self.id} rate", time, chamber, 0.0)
        slow = memory.lag(f"{self.id} slow", time, rate, period)
        fast = memory.lag(f"{self.id} fast", time, rate, 0.25 * period)
        # Of exp(-t) - exp(-4 t).
        peak = 0.75 * 4.0 ** (-1.0 / 3.0)
        swing = line(inputs, period, shape["phase"])
        return chamber + amplitude * (swing + shape["overshoot"] / peak * (slow - fast))


class Airflow(ThermalEffect):
    """How well the chamber's air reaches the unit depends on fan and table rate.

    ::

        G_air = G (1 + k fan) / (1 + k) * (1 + rotation_share k sqrt(|rate| / 100 deg/s))

    relative to fan on and table at rest, for which time constants are stated. k is the amplitude; beyond 100
    deg/s the air gains no more. Sensors show it, so that a replay lacks nothing.

    Source: convection (literature); ranges are engineering ones.
    """

    code = "A4"
    title = "Airflow about the unit"
    amplitude = unsigned("1", (0.2, 2.0), (0.2, 2.0), "k", 100.0)
    shape = (shared("rotation_share", "1", (0.0, 0.5), "of the table, in units of k", (0.0, 10.0)),)
    sources = ("F. P. Incropera and D. P. DeWitt, Fundamentals of Heat and Mass Transfer",)
    shows = "time constants that change with fan and table rate"
    confused_with = {
        "thermal_network": "the fan off and on in a ramp",
        "chamber_setpoint_vs_air": "the end of a soak: airflow leaves no difference there",
    }
    candidate = False

    def change_plant(self, plant: Network, amplitude: float, **shape: float) -> Network:
        return plant.with_airflow(amplitude, shape["rotation_share"] * amplitude)


class HiddenThermalNode(ThermalEffect):
    """A second boundary, such as the table's plate, that follows the air slowly and acts on the bias.

    ::

        b = A (T_h - T),      time_constant dT_h/dt = T_chamber - T_h

    with the coil's temperature T, and the nearest sensor to the air in place of T_chamber where that is not
    recorded.

    Source: heat equation (derived); a lag of 20 to 60 min is an engineering range.
    """

    code = "A5"
    family = "hidden_node"
    place = "chamber"
    title = "Hidden thermal node"
    amplitude = signed("deg/h/degC", (0.01, 0.5), (2e-4, 1e-2), "A", 1e3)
    shape = (shared("time_constant", "s", (1200.0, 3600.0), "of the hidden node", (1.0, 1e6)),)
    needs = ("T", "T_chamber")
    sources = ("Heat equation of a network of nodes",)
    shows = "a tail of tens of minutes after each ramp, with all sensors at rest"
    confused_with = {
        "stress_relaxation": "a power step with sensors flat; relaxation is quicker when hot",
        "thermal_hysteresis": "a soak of several time constants: the node comes to rest",
        "shupe_mohr": "the end of a ramp: this one has a tail",
        "warmup_bias": "a power cycle at constant temperature",
        "moisture": "its time scale: hours to days",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        air = inputs.temperature("T_chamber")
        node = inputs.memory.lag(self.id, inputs.time, air, shape["time_constant"])
        return node - inputs.temperature("T")


class ChamberSetpointVsAir(ThermalEffect):
    """Air at the unit that falls short of the set point: stratification.

    ::

        T_air = T_set - A (T_set - 25) / 50 * (2 - fan)

    A is the shortfall 50 degC away from the room with the fan on; it doubles with the fan off. Sensors on
    the unit show all of it, so that a replay lacks nothing.

    Source: chamber practice; 1 to 3 degC is an engineering range.
    """

    code = "G13"
    title = "Set point of the chamber against its air"
    amplitude = Quantity(
        "amplitude", "degC", (1.0, 3.0), (1.0, 3.0), "at 50 degC off the room", (-50.0, 50.0)
    )
    sources = ("Data sheets of climatic chambers",)
    shows = "between the set point and a sensor on the unit, most at the ends of the range"
    confused_with = {
        "sensor_offset": "a soak at room temperature: an offset stays",
        "airflow": "its end: stratification stays in a long soak",
    }
    candidate = False

    def change_chamber(
        self, chamber: FloatArray, inputs: Inputs, amplitude: float, **shape: float
    ) -> FloatArray:
        return chamber - amplitude * (chamber - 25.0) / 50.0 * (2.0 - inputs.drive("fan"))
