"""A scale factor that drifts while a misalignment is tested, as the gyro's temperature does, taken off.

The slope of state j at tilt t, measured at the place x of the test, from -1/2 to 1/2, is

    s = K (1 + k x + q (x**2 - 1/12)) (a_z cos(t + e) + a_j sin(t + e)) + f_j

with a_j along the fixture's x, a constant f_j for a fixture tilted across, and K the mean over the test; the
square makes room for a warm-up that slows down. All slopes together give k and q by least squares; where they
are beyond chance, s over the bracket goes on in its place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fogml.arrays import FloatArray
from fogml.lab.misalignment_errors import ROUND_OFF, ScaleDrift, Slopes
from fogml.lab.misalignment_states import pairs_of
from fogml.numerals import short
from fogml.signals.distributions import variances_sf

_ITERATIONS = 20  # of Gauss and Newton at most: three or four do
_TERMS = 2  # a line and a square, as a warm-up slows down


def scale_drift(
    slopes: Mapping[int, Slopes], angles_deg: Sequence[float], cross_tilt: bool, doubt: float
) -> ScaleDrift | None:
    """The drift where slopes show it, by an F test at the level `doubt`; None where they don't, or can't.

    Parameters
    ----------
    slopes
        By state, with their places.
    angles_deg
        Turn of each state, clockwise as seen from +z [deg].
    cross_tilt
        Whether a constant over the tilts of each state goes along, so that none is taken for a drift.
    doubt
        Probability of a drift that is told where there is none.
    """
    held = list(slopes.values())
    if any(np.isnan(one.places).any() for one in held):
        return None
    model = _Model(held, angles_deg, cross_tilt)
    steady = model.fitted(drifts=False)[1]
    found, squares = model.fitted(drifts=True)
    dof = len(model.slopes) - len(found)
    floor = (ROUND_OFF * float(np.abs(model.slopes).max())) ** 2
    if dof < 1 or steady <= floor * len(model.slopes):
        return None
    if squares > 0.0 and variances_sf((steady - squares) / _TERMS / (squares / dof), _TERMS, dof) > doubt:
        return None
    by_slopes = np.linalg.pinv(model.jacobian(found))[-_TERMS:]
    grown = 1.0 + model.terms @ found[-_TERMS:]
    ends = np.cumsum([len(one.values) for one in held])[:-1]
    moves = (model.slopes / grown)[:, None] * model.terms
    return ScaleDrift(
        float(found[-_TERMS]),
        float(np.linalg.norm(by_slopes[0]) * np.sqrt(squares / dof)),
        tuple(np.split(grown, ends)),
        tuple(np.split(by_slopes, ends, axis=1)),
        tuple(np.split(moves, ends)),
    )


class _Model:
    """All slopes by K a_x, K a_y, K a_z, zero errors, constants of the states, and the drift's two terms."""

    def __init__(self, held: Sequence[Slopes], angles_deg: Sequence[float], cross_tilt: bool) -> None:
        self.slopes = np.concatenate([one.values for one in held])
        places = np.concatenate([one.places for one in held])
        self.terms = np.column_stack((places, places**2 - 1.0 / 12.0))
        self.tilt = np.radians(np.concatenate([one.tilts for one in held]))
        state = np.repeat(np.arange(len(held)), [len(one.values) for one in held])
        turn = np.radians(np.asarray(angles_deg, dtype=np.float64))[state]
        self.turn = np.column_stack((np.cos(turn), np.sin(turn)))
        self.parts = pairs_of(angles_deg)[state]
        self.constants = np.eye(len(held))[state] if cross_tilt else np.zeros((len(state), 0))

    def _parts(self, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What a drift multiplies, its derivative by the tilt, and the columns of K a, shape (n, 3)."""
        tilt = self.tilt + self.parts @ values[3 : 3 + self.parts.shape[1]]
        columns = np.column_stack((self.turn * np.sin(tilt)[:, None], np.cos(tilt)))
        turned = np.column_stack((self.turn * np.cos(tilt)[:, None], -np.sin(tilt)))
        return columns @ values[:3], turned @ values[:3], columns

    def jacobian(self, values: FloatArray) -> FloatArray:
        """Derivatives of the slopes by all values, shape (n, p)."""
        curve, steep, columns = self._parts(values)
        grown = (1.0 + self.terms @ values[-_TERMS:])[:, None]
        by_errors = grown * steep[:, None] * self.parts
        return np.column_stack((grown * columns, by_errors, self.constants, curve[:, None] * self.terms))

    def fitted(self, drifts: bool) -> tuple[FloatArray, float]:
        """Values by Gauss-Newton, and the squares left."""
        count = 3 + self.parts.shape[1]
        values = np.zeros(count + self.constants.shape[1] + _TERMS)
        values[:3] = np.linalg.lstsq(self._parts(values)[2], self.slopes, rcond=None)[0]
        free = len(values) if drifts else len(values) - _TERMS
        for step in range(_ITERATIONS + 1):
            grown = 1.0 + self.terms @ values[-_TERMS:]
            left = self.slopes - grown * self._parts(values)[0] - self.constants @ values[count:-_TERMS]
            if step < _ITERATIONS:
                values[:free] += np.linalg.lstsq(self.jacobian(values)[:, :free], left, rcond=None)[0]
        return values, float(left @ left)


def drift_words(drift: ScaleDrift | None) -> tuple[str, ...]:
    """What was taken off, as a note."""
    if drift is None:
        return ()
    return (
        f"the scale factor drifts by {short(1e6 * drift.share)} ppm over the test (standard error "
        f"{short(1e6 * drift.se, 2)}), as with temperature: taken off, so that K is its mean over the test",
    )
