"""Optics of the interferometer: Sagnac constant, proper frequency, resets, polarisation, photon noise.

Numbers are those of one fibre coil, stated by `Coil`; the defaults are the reference coil of the
catalogue: 1 km of silica fibre on 0.1 m at 1550 nm.

References
----------
H. C. Lefevre, The Fiber-Optic Gyroscope, 2nd ed. (2014), for all of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, TypeVar, get_args

import numpy as np

from fogml.arrays import FloatArray
from fogml.twin.quantities import check_all, limited

_Power = TypeVar("_Power", float, FloatArray)
LIGHT_M_S = 299_792_458.0
ELECTRON_C = 1.602176634e-19
BOLTZMANN_J_K = 1.380649e-23
Spectrum = Literal["gaussian", "flat"]
Winding = Literal["cylinder", "dipole", "quadrupole", "octupole"]
WINDINGS: tuple[Winding, ...] = get_args(Winding)
_COHERENCE: dict[Spectrum, float] = {"gaussian": 2.0 * math.sqrt(2.0 * math.log(2.0) / math.pi), "flat": 2.0}
DEG_H = math.pi / 180.0 / 3600.0
"""One deg/h in rad/s."""

COIL = (
    limited("length", "m", 1.0, 1e5),
    limited("diameter", "m", 1e-3, 10.0),
    limited("wavelength", "m", 1e-7, 1e-5),
    limited("index", "1", 1.0, 4.0),
    limited("index_slope", "1/degC", -1e-3, 1e-3),
    limited("expansion", "1/degC", -1e-3, 1e-3),
    limited("pitch", "m", 1e-6, 1e-2),
    limited("diffusivity", "m2/s", 1e-9, 1e-3),
    limited("lead_1", "m", 0.0, 1e3),
    limited("lead_2", "m", 0.0, 1e3),
)
"""The constants of `Coil` with their units."""
RECEIVER = (
    limited("line_width", "m", 1e-12, 1e-6),
    limited("responsivity", "A/W", 1e-3, 10.0),
    limited("resistance", "ohm", 1.0, 1e9),
    limited("temperature_k", "K", 1.0, 1e3),
)
"""The constants of `Receiver` with their units."""


@dataclass(frozen=True)
class Coil:
    """A fibre coil and its light.

    Attributes
    ----------
    length, diameter
        Of the fibre and of the coil [m].
    wavelength
        Mean wavelength in vacuum [m].
    index, index_slope, expansion
        Refractive index n, dn/dT [1/K] and expansion alpha of the fibre [1/K].
    winding, layers
        How it is wound, and in how many layers.
    pitch, diffusivity
        Distance of neighbouring layers [m], and how heat goes across them [m**2/s].
    lead_1, lead_2
        Fibre outside of the coil [m]: beside the electronics at its far end, along the case at its near end.
    """

    length: float = 1000.0
    diameter: float = 0.10
    wavelength: float = 1550e-9
    index: float = 1.4525
    index_slope: float = 0.97e-5
    expansion: float = 0.55e-6
    winding: Winding = "quadrupole"
    layers: int = 32
    pitch: float = 0.25e-3
    diffusivity: float = 2e-7
    lead_1: float = 0.0
    lead_2: float = 0.0

    def __post_init__(self) -> None:
        check_all(self, (*COIL, limited("layers", "layers", 3, 1000, whole=True)), "coil")

    @property
    def phase_slope(self) -> float:
        """c_T = dn/dT + n alpha [1/K], which turns a change of temperature into one of optical path."""
        return self.index_slope + self.index * self.expansion

    @property
    def sagnac_s(self) -> float:
        """Sagnac constant K_S = 2 pi L D / (lambda c): radians of phase per rad/s."""
        return 2.0 * math.pi * self.length * self.diameter / (self.wavelength * LIGHT_M_S)

    @property
    def phase_per_deg_h(self) -> float:
        """Sagnac phase of 1 deg/h [rad]."""
        return self.sagnac_s * DEG_H

    @property
    def transit_s(self) -> float:
        """Transit time of the coil n L / c [s]."""
        return self.index * self.length / LIGHT_M_S

    @property
    def proper_frequency_hz(self) -> float:
        """Proper frequency 1 / (2 transit time) [Hz]."""
        return 0.5 / self.transit_s

    @property
    def proper_frequency_slope(self) -> float:
        """Relative change of the transit time with temperature, dn/dT / n + alpha [1/K].

        The proper frequency falls by as much.
        """
        return self.index_slope / self.index + self.expansion

    @property
    def fringe_offset_deg_s(self) -> float:
        """Rate error of a closed loop that is one fringe (2 pi) off, lambda c / (L D) [deg/s]."""
        return math.degrees(2.0 * math.pi / self.sagnac_s)


def relative_intensity_noise(
    line_width: float, wavelength: float = 1550e-9, spectrum: Spectrum = "gaussian"
) -> float:
    """Excess noise of a polarised broadband source, one-sided [1/Hz].

    Thermal light of one polarisation has a density of twice its coherence time, the integral of the squared
    degree of coherence (unpolarised light half of it): over ``1 / dnu = lambda**2 / (c dlambda)`` that
    is 2 for a flat spectrum and ``2 sqrt(2 ln 2 / pi) = 1.33`` for a Gaussian one.

    Parameters
    ----------
    line_width
        Full width at half of the maximum [m].
    wavelength
        Mean wavelength [m].
    spectrum
        ``gaussian`` or ``flat``.

    References
    ----------
    J. W. Goodman, Statistical Optics (1985), section 6.1.
    """
    return _COHERENCE[spectrum] * wavelength * wavelength / (LIGHT_M_S * line_width)


@dataclass(frozen=True)
class Receiver:
    """Source and receiver of the light.

    Attributes
    ----------
    line_width
        Of the source, polarised and Gaussian, at half of its maximum [m].
    responsivity
        Of the diode [A/W].
    resistance
        Of the transimpedance amplifier [ohm].
    temperature_k
        Of that resistance [K].
    """

    line_width: float = 10e-9
    responsivity: float = 0.9
    resistance: float = 100e3
    temperature_k: float = 300.0

    def __post_init__(self) -> None:
        check_all(self, RECEIVER, "receiver")

    def angle_random_walk(self, coil: Coil, power: float, modulation_depth: float) -> float:
        """Angle random walk [deg/sqrt(h)] from shot, thermal and excess noise.

        Parameters
        ----------
        coil
            The coil, for the Sagnac constant.
        power
            Peak power at the diode P0 [W].
        modulation_depth
            Phase bias phi_m [rad].

        Notes
        -----
        One-sided phase density ``S = (2 e I + 4 k T / R_f + I**2 RIN) / (R P0 sin(phi_m) / 2)**2``
        with ``I = R P0 (1 + cos phi_m) / 2``, and ``N = sqrt(S / 2) / K_S``.
        """
        return phase_noise_to_walk(self.phase_density(coil, power, modulation_depth), coil)

    def phase_density(self, coil: Coil, power: _Power, modulation_depth: float) -> _Power:
        """One-sided density of the phase noise S [rad**2/Hz]; parameters as `angle_random_walk`.

        A power of shape (n,) gives a density of shape (n,).
        """
        current = 0.5 * self.responsivity * power * (1.0 + math.cos(modulation_depth))
        slope = 0.5 * self.responsivity * power * math.sin(modulation_depth)
        shot = 2.0 * ELECTRON_C * current
        thermal = 4.0 * BOLTZMANN_J_K * self.temperature_k / self.resistance
        excess = current * current * relative_intensity_noise(self.line_width, coil.wavelength)
        return (shot + thermal + excess) / (slope * slope)


def phase_noise_to_walk(density: _Power, coil: Coil) -> _Power:
    """Angle random walk [deg/sqrt(h)] of a one-sided white phase noise [rad**2/Hz]."""
    return (0.5 * density) ** 0.5 * (60.0 * math.degrees(1.0 / coil.sagnac_s))


REFERENCE_COIL = Coil()
"""The coil of all worked numbers in the catalogue."""


@dataclass(frozen=True)
class Light:
    """Receiver and course of the light of a unit.

    Attributes
    ----------
    receiver
        Diode, amplifier and line width of the source.
    power_loss, power_slope
        Loss off 25 degC [dB/degC] and change [dB/(100 degC)] of the light's power, of which noise, loop gain
        and cross-talk then all go; None where each of these states its own.
    """

    receiver: Receiver = field(default_factory=Receiver)
    power_loss: float | None = None
    power_slope: float = 0.0

    def level(self, u: FloatArray, *, power_loss: float = 0.0, power_slope: float = 0.0) -> FloatArray:
        """Power over that at 25 degC at a temperature u off it [degC], shape (n,).

        ::

            P / P_0 = 10**(power_slope u / 1000 - power_loss |u| / 10)

        with the unit's own course where it has one, else with the stated one.
        """
        if self.power_loss is not None:
            power_loss, power_slope = self.power_loss, self.power_slope
        decades = 1e-3 * power_slope * u - 0.1 * power_loss * np.abs(u)
        # Half the time of a power of 10.
        return np.exp(math.log(10.0) * decades)
