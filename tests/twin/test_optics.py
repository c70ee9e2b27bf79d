"""Optics of the reference coil against the catalogue's worked numbers and plain derivations."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.twin.optics import (
    REFERENCE_COIL,
    Coil,
    Receiver,
    Spectrum,
    phase_noise_to_walk,
    relative_intensity_noise,
)


def test_worked_numbers_of_the_reference_coil() -> None:
    coil = REFERENCE_COIL
    assert coil.sagnac_s == pytest.approx(1.352, abs=5e-4)
    assert 1e6 * coil.phase_per_deg_h == pytest.approx(6.56, abs=5e-3)
    assert 1e6 * coil.transit_s == pytest.approx(4.845, abs=5e-4)
    assert 1e-3 * coil.proper_frequency_hz == pytest.approx(103.2, abs=0.05)
    assert coil.fringe_offset_deg_s == pytest.approx(266.0, abs=0.5)
    assert math.radians(coil.fringe_offset_deg_s) == pytest.approx(4.65, abs=5e-3)
    assert 1e6 * coil.proper_frequency_slope == pytest.approx(7.0, abs=0.5)


def test_sagnac_constant_from_path_difference() -> None:
    coil = Coil(length=500.0, diameter=0.2, wavelength=1310e-9)
    turns = coil.length / (math.pi * coil.diameter)
    area = turns * math.pi * (0.5 * coil.diameter) ** 2
    seconds = 4.0 * area / 299792458.0**2  # time between the two arrivals for 1 rad/s
    light = 2.0 * math.pi * 299792458.0 / coil.wavelength
    assert coil.sagnac_s == pytest.approx(light * seconds, rel=1e-12)


@pytest.mark.parametrize(("depth", "walk"), [(0.5, 1.89e-3), (0.75, 8.2e-4), (0.875, 4.9e-4)])
def test_angle_random_walk_of_photon_noise(depth: float, walk: float) -> None:
    found = Receiver().angle_random_walk(REFERENCE_COIL, 20e-6, depth * math.pi)
    assert found == pytest.approx(walk, rel=0.015)


@pytest.mark.parametrize("spectrum", ["gaussian", "flat"])
def test_excess_noise_is_twice_the_coherence_time_of_polarised_light(spectrum: Spectrum) -> None:
    """The integral of |gamma(tau)|**2, by Parseval that of the spectrum's square over its area squared."""
    width = 10e-9 / 1550e-9**2 * 299_792_458.0
    f = width * np.linspace(-4.0, 4.0, 200_001)
    shape = np.exp(-4.0 * np.log(2.0) * (f / width) ** 2) if spectrum == "gaussian" else np.abs(f) < width / 2
    coherence = np.trapezoid(shape**2.0, f) / np.trapezoid(shape * 1.0, f) ** 2
    assert relative_intensity_noise(10e-9, spectrum=spectrum) == pytest.approx(2.0 * coherence, rel=1e-4)
    over = 1.33 if spectrum == "gaussian" else 2.0
    assert 10.0 * math.log10(relative_intensity_noise(10e-9, spectrum=spectrum) / over) == pytest.approx(
        -121.0, abs=0.1
    )


def test_how_each_noise_follows_the_power() -> None:
    depth = 0.75 * math.pi
    broad = Receiver(line_width=1e-6)

    def walk(receiver: Receiver, power: float) -> float:
        return receiver.angle_random_walk(REFERENCE_COIL, power, depth)

    assert walk(Receiver(), 1e-2) == pytest.approx(walk(Receiver(), 2e-2), rel=0.01)  # excess
    # Shot noise is what goes with the power, beside what stays and what goes with its square.
    powers = np.array([1e-7, 2e-7, 4e-7])
    noise = [
        broad.phase_density(REFERENCE_COIL, p, depth) * (0.45 * p * math.sin(depth)) ** 2 for p in powers
    ]
    shot = np.linalg.solve(np.vander(powers / 1e-7, increasing=True), noise)[1]
    assert shot == pytest.approx(2.0 * 1.602176634e-19 * 0.45e-7 * (1.0 + math.cos(depth)), rel=1e-6)
    assert walk(broad, 1e-9) == pytest.approx(2.0 * walk(broad, 2e-9), rel=0.01)  # thermal


def test_walk_of_a_phase_density() -> None:
    # One-sided 2 x (K_S rad)**2/Hz is 1 (rad/s)**2/Hz two-sided: 1 rad/sqrt(s), 60 x 57.3 deg/sqrt(h).
    density = 2.0 * REFERENCE_COIL.sagnac_s**2
    assert phase_noise_to_walk(density, REFERENCE_COIL) == pytest.approx(60.0 * math.degrees(1.0))


@pytest.mark.parametrize("fault", [{"length": 0.0}, {"diameter": -1.0}, {"index": math.nan}])
def test_unphysical_coils_are_refused(fault: dict[str, float]) -> None:
    with pytest.raises(InputError, match=f"coil: '{next(iter(fault))}' is"):
        Coil(**fault)
