"""What machines, supply and cables put into bias and noise."""

from __future__ import annotations

import numpy as np

from fogml.arrays import FloatArray
from fogml.signals.bases import sine
from fogml.twin.effect import BiasEffect, WhiteNoiseEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import phase, shared, signed, unsigned
from fogml.twin.responses import line


class ElectronicCrosstalk(BiasEffect):
    """Leakage of the modulation into the demodulator, as it follows electronics and supply.

    ::

        b = e_1 (T_electronics - 25) + e_2 (V - V_0)

    The amplitude is e_1; ``supply_ratio`` is e_2 / e_1. V_0 is the supply at the first sample. What leaks
    weighs the more the less light there is: where ``light_power`` is on, b is over the light left. The
    constant part e_0 is one of the bias itself. Where no supply is recorded to change, nothing tells it from
    whatever else follows the electronics, and where their temperature is not, from `supply_ripple`: a
    diagnosis does not offer it.

    Source: Lefevre (literature); ranges, 0.05 to 1 deg/h (tactical) and 1e-3 to 1e-2 deg/h (navigation)
    over 50 degC, are engineering ones.
    """

    code = "C4"
    place = "electronics"
    title = "Electronic cross-talk"
    amplitude = signed("deg/h/degC", (1e-3, 2e-2), (2e-5, 2e-4), "e_1", 100.0)
    shape = (shared("supply_ratio", "degC/V", (-20.0, 20.0), "e_2 / e_1", (-1e4, 1e4)),)
    needs = ("T_electronics", "supply")
    told_by = (("supply",), ("T_electronics",))
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a bias that follows the electronics: self-heating after power-on, then the chamber"
    confused_with = {
        "bias_polynomial": "a power step moves the electronics alone",
        "proper_frequency_mismatch": "a sweep of the modulation frequency",
        "deadband": "a sweep of the rate through zero",
        "warmup_bias": "a ramp of the chamber moves this one too",
        "supply_ripple": "steps of the supply at constant temperature",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        supply = inputs.drive("supply")
        change = supply - inputs.memory.first(f"{self.id} supply", supply)
        u = inputs.u("T_electronics")
        return (u + shape["supply_ratio"] * change) / inputs.light.level(u)


class SupplyRipple(BiasEffect):
    """The bias follows the supply, and its ripple appears at an alias of its frequency.

    ::

        b = k_dc ((V - V_0) + a sin(2 pi f t + phase))

    The amplitude is k_dc; V_0 is the supply at the first sample. ``ripple`` a is the ripple as the
    samples hold it, k_ac / k_dc times its size after their averaging [V]; ``alias_frequency`` f is
    |f_r - m f_s| [Hz] for a ripple at f_r and samples at f_s. Where no supply is recorded to change, nothing
    tells it from any other line, and a diagnosis does not offer it.

    Source: aliasing of a line (derived); Lefevre (literature); ranges are engineering ones.
    """

    code = "C8"
    family = "supply"
    place = "electronics"
    title = "Supply voltage and ripple"
    amplitude = signed("deg/h/V", (0.05, 1.0), (1e-3, 2e-2), "k_dc", 1e3)
    shape = (
        shared("ripple", "V", (0.04, 0.5), "a", (0.0, 100.0), default=0.05),
        shared("alias_frequency", "Hz", (1e-4, 1e-2), "f", (1e-6, 1e3)),
        phase("phase", "at time 0"),
    )
    needs = ("supply",)
    told_by = (("supply",),)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a narrow line at the alias frequency, and steps with the supply"
    confused_with = {
        "chamber_pickup": "the line's frequency: the chamber's cycle is its own clock",
        "chamber_ripple": "the line's frequency; a sensor in the chamber's air",
        "electronic_crosstalk": "steps of the supply at constant temperature",
        "sinusoidal": "another supply: this line goes with it",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        supply = inputs.drive("supply")
        change = supply - inputs.memory.first(f"{self.id} supply", supply)
        return change + shape["ripple"] * sine(
            shape["alias_frequency"] * inputs.time + shape["phase"] / 360.0
        )


class ChamberPickup(BiasEffect):
    """Electromagnetic pick-up of the chamber's switching: a bias that follows its machines.

    ::

        b = A (heater + compressor)

    with their duties, 0 to 1. Where neither is recorded they are taken for a cycle of their own,
    (1 + sin(2 pi t / period + phase)) / 2; nothing tells that from any other line, and a diagnosis does not
    offer it.

    Source: interference synchronous with the duty cycle; form and ranges are engineering ones.
    """

    code = "F4"
    family = "machines"
    place = "chamber"
    title = "Pick-up of the chamber's machines"
    amplitude = signed("deg/h", (0.01, 0.5), (5e-4, 1e-2), "A", 1e4)
    shape = (
        shared("period", "s", (60.0, 900.0), "of an unrecorded cycle", (0.1, 1e6)),
        phase("phase", "at time 0"),
    )
    needs = ("compressor", "heater")
    told_by = (("compressor", "heater"),)
    sources = ("IEEE Std 952-1997",)
    shows = "steps and lines in step with heater and compressor, without delay"
    confused_with = {
        "vibration_rectification": "a vibration sensor; heater steps shake nothing",
        "chamber_ripple": "its delay: temperature comes late and smoothed",
        "magnetic": "a field sensor, or the same current in another loop",
        "supply_ripple": "the chamber off at the same supply",
        "acoustic": "heater and compressor off with the fan on",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        if "heater" in inputs.drives or "compressor" in inputs.drives:
            return inputs.drive("heater") + inputs.drive("compressor")
        return 0.5 + 0.5 * line(inputs, shape["period"], shape["phase"])


class CableAndSlipRing(BiasEffect):
    """Supply that drops over brushes and cable while the table moves.

    ::

        b = A |rate| / (|rate| + half_rate)

    The amplitude is the shift at high table rates, half of which is there at ``half_rate``. Bursts of noise
    that come with it are those of ``outliers_dropouts``.

    Source: form and ranges are engineering ones, the latter from a drop of 0.1 to 1 V at the supply's
    sensitivity.
    """

    code = "F5"
    title = "Cable and slip ring"
    amplitude = signed("deg/h", (0.01, 1.0), (1e-4, 2e-2), "A", 1e4)
    shape = (shared("half_rate", "deg/s", (0.1, 10.0), "rate of half the shift", (1e-6, 1e4)),)
    needs = ("rate",)
    sources = ("Engineering practice of rate tables",)
    shows = "a shift while the table moves, the same for both directions and nearly for all rates"
    shown_on = "turns of half a minute"
    confused_with = {
        "sf_asymmetry": "two rates: asymmetry grows with the rate",
        "vibration_rectification": "a vibration sensor on the table",
        "supply_ripple": "the supply's own record",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Response per deg/h [deg/h], shape (n,), between 0 and 1."""
        rate = np.abs(inputs.turning_deg_s)
        return rate / (rate + shape["half_rate"])


class Acoustic(BiasEffect):
    """Elasto-optic phase of sound at a resonance of the coil, as the samples alias it.

    ::

        b = a fan sin(2 pi t / alias_period + phase),      1 / alias_period = |f - m f_s|

    for a resonance at f, 0.5 to 5 kHz, and samples at f_s; the fan's duty stands for the sound's level. The
    amplitude a is that in the recording with the fan fully on.

    Source: aliasing of a line (derived); ranges are engineering ones.
    """

    code = "F3"
    title = "Sound in the chamber"
    amplitude = unsigned("deg/h", (1e-3, 0.1), (1e-4, 5e-3), "a", 1e5)
    shape = (
        shared("alias_period", "s", (30.0, 600.0), "in the recording", (1e-3, 1e7)),
        phase("phase", "at time 0"),
    )
    needs = ("fan",)
    sources = ("H. C. Lefevre, The Fiber-Optic Gyroscope",)
    shows = "a narrow line that is gone with the fan off"
    confused_with = {
        "table_jitter": "the fan off: only this line goes",
        "supply_ripple": "the fan off at the same supply",
        "chamber_pickup": "the fan off with heater and compressor as they were",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return inputs.drive("fan") * line(inputs, shape["alias_period"], shape["phase"])


class VibrationRectification(BiasEffect):
    """A steady shift of the bias under vibration.

    ::

        b = k_v g_rms**2

    with g_rms the vibration [g], and k_v with the gain of the unit's resonances in it. Sources that shake
    independently add in squares. The noise that comes with it is ``vibration_noise``.

    Source: second-order response (literature); ranges are engineering ones.
    """

    code = "F1"
    family = "vibration"
    place = "mount"
    title = "Vibration rectification"
    amplitude = signed("deg/h/g2", (0.01, 1.0), (1e-4, 2e-2), "k_v", 1e6)
    needs = ("vibration",)
    sources = ("IEEE Std 952-1997", "H. C. Lefevre, The Fiber-Optic Gyroscope")
    shows = "a shift with the vibration, such as while the compressor runs, together with more noise"
    confused_with = {
        "chamber_pickup": "a vibration sensor; the compressor off for ten minutes in a soak",
        "bias_polynomial": "the compressor off for ten minutes in a soak",
        "vibration_noise": "the mean: noise has none",
        "g_sensitivity": "another attitude at rest changes that one alone",
    }

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        return np.square(inputs.drive("vibration"))


class VibrationNoise(WhiteNoiseEffect):
    """White noise of the rate under vibration, which random strain of the coil makes.

    ::

        N = A g_rms

    in deg/sqrt(h), with g_rms the vibration [g]: strain is in proportion to acceleration, so its density is
    to g_rms**2. It comes with ``vibration_rectification``, which is of second order.

    Source: first-order response to random vibration (derived); ranges are engineering ones, of units whose
    noise doubles at some g rms.
    """

    code = "E11"
    title = "Noise under vibration"
    amplitude = unsigned("deg/sqrt(h)/g", (2e-3, 5e-2), (1e-4, 2e-3), "A", 1e6)
    needs = ("vibration",)
    sources = ("IEEE Std 952-1997", "H. C. Lefevre, The Fiber-Optic Gyroscope")
    shows = "more white noise while something shakes, such as the compressor"
    confused_with = {
        "angle_random_walk": "all machines off: that one stays",
        "vibration_rectification": "the mean, which that one shifts",
    }
    candidate = False

    def strength(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Vibration [g], shape (n,)."""
        return inputs.drive("vibration")
