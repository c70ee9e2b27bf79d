"""The four mounting states: how each is turned, the gyro's axis from all of them, and whether they agree.

A state turned by phi in the mounting plane, clockwise as seen from +z (against the reference axis), has the
input axis a_x cos phi + a_y sin phi along the fixture's x, so that its slope over the table rate at tilt t is
K (a_z cos(t + e) + (a_x cos phi + a_y sin phi) sin(t + e)) with the zero error e of the fixture.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from fogml.arrays import FloatArray
from fogml.errors import InputError
from fogml.numerals import short
from fogml.signals.distributions import variances_isf, variances_sf

STATES = (1, 2, 3, 4)
DOCUMENT_ANGLES_DEG = (0.0, 180.0, 270.0, 90.0)
"""Turn of each state where none is stated: by 180, by 90 more and by 180 more, all clockwise (source document
of :mod:`fogml.lab.misalignment`)."""
_ITERATIONS = 60


def solve(c: FloatArray, weights: FloatArray, angles_deg: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Scale factor and axis of least squares from the coefficients of the states.

    Parameters
    ----------
    c
        Coefficients of cosine and sine over the tilts by state, shape (4, 2) [output per deg/s].
    weights
        Square roots of their information, shape (4, 2, 2): ``weights[j] @ (c[j] - model[j])`` is white.
    angles_deg
        Turn of each state, clockwise as seen from +z [deg].

    Returns
    -------
    values
        K, dx, dy, d, e_x, e_y; angles in deg, shape (6,).
    gradient
        Of the values by ``c``, shape (6, 4, 2).

    Raises
    ------
    InputError
        If the turns of the states do not tell both components.
    """
    parts = pairs_of(angles_deg)
    unit, c, weights = _of_size_1(c, weights)
    found, jacobian, _ = _fitted(c, weights, angles_deg, parts)
    axis, errors = found[:3], found[3:]
    k = float(np.linalg.norm(axis))
    across = float(np.hypot(axis[0], axis[1]))
    angles = [*np.arcsin(axis[:2] / k), np.arctan2(across, axis[2]), errors[0], errors[-1]]
    # Derivatives by K a and the zero errors, then by what these were fitted to.
    outer = np.zeros((6, len(found)))
    outer[0, :3] = axis / k
    for i in (0, 1):
        outer[1 + i, :3] = (np.eye(3)[i] - axis[i] * axis / k**2) / np.sqrt(k**2 - axis[i] ** 2)
    if across > 0.0:
        outer[3, :3] = np.array([*axis[:2] * axis[2] / across, -across]) / k**2
    outer[4, 3] = outer[5, -1] = 1.0
    outer[1:] = np.degrees(outer[1:])
    inner = np.linalg.pinv(jacobian).reshape(len(found), len(c), 2)
    gradient = np.einsum("vp,pja,jab->vjb", outer, inner, weights)
    gradient[1:] /= unit
    return np.array([unit * k, *np.degrees(angles)]), np.asarray(gradient)


def _of_size_1(c: FloatArray, weights: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """The coefficients' size, and they and their weights in it: beside angles in rad they are as large."""
    unit = float(np.abs(c).max()) or 1.0
    return unit, c / unit, weights * unit


def pairs_of(angles_deg: Sequence[float]) -> FloatArray:
    """Which zero error each state has: one of those along x, one of those along y, where both have two."""
    turns = np.radians(np.asarray(angles_deg, dtype=np.float64))
    along_y = np.abs(np.sin(turns)) > np.abs(np.cos(turns))
    parts = np.stack([~along_y, along_y], axis=-1).astype(np.float64)
    return parts if parts.sum(axis=0).min() >= 2 else np.ones((len(turns), 1))


def _fitted(
    c: FloatArray, weights: FloatArray, angles_deg: Sequence[float], parts: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """K a_x, K a_y, K a_z and zero errors [rad] by Gauss-Newton, the white design, the squares left."""
    turns = np.radians(np.asarray(angles_deg, dtype=np.float64))
    cos, sin = np.cos(turns), np.sin(turns)
    values = np.zeros(3 + parts.shape[1])

    def whitened(pairs: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("jab,jb...->ja...", weights, pairs)).reshape(2 * len(turns), -1)

    def parts_of(values: FloatArray) -> tuple[FloatArray, FloatArray]:
        error = parts @ values[3:]
        cos_e, sin_e = np.cos(error), np.sin(error)
        along = values[0] * cos + values[1] * sin
        model = np.stack([values[2] * cos_e + along * sin_e, along * cos_e - values[2] * sin_e], axis=-1)
        axis = np.stack(
            [
                np.stack([cos * sin_e, sin * sin_e, cos_e], -1),
                np.stack([cos * cos_e, sin * cos_e, -sin_e], -1),
            ],
            1,
        )
        turning = np.stack([model[:, 1], -model[:, 0]], axis=1)[:, :, None] * parts[:, None, :]
        return model, np.concatenate([axis, turning], axis=2)

    # With no zero error the model is linear: where the iteration begins.
    _, first = parts_of(values)
    values[:3] = np.linalg.lstsq(whitened(first[:, :, :3]), whitened(c)[:, 0], rcond=None)[0]
    model, jacobian = parts_of(values)
    for _ in range(_ITERATIONS):
        design = whitened(jacobian)
        step, _, rank, _ = np.linalg.lstsq(
            design / np.abs(design).max(), whitened(c - model)[:, 0], rcond=1e-9
        )
        step = step / np.abs(design).max()
        if rank < len(values):
            raise InputError(
                f"the states are turned by {stated(angles_deg)} deg: that does not tell both components of "
                "the misalignment; turn the gyro by quarter turns, say 0, 180, 270 and 90 deg"
            )
        values = values + step
        model, jacobian = parts_of(values)
        scale = np.array([*np.full(3, np.abs(values[:3]).max()), *np.ones(parts.shape[1])])
        if (np.abs(step) <= 1e-15 * scale).all():
            break
    left = whitened(c - model)[:, 0]
    return values, whitened(jacobian), float(left @ left)


def _check_follows(c: FloatArray, weights: FloatArray, dof: int, source: str, chance: float = 0.01) -> None:
    """Hold that the slopes are more than noise alone makes in a share `chance` of cases (F test)."""
    white = np.einsum("jab,jb->ja", weights, c)
    if variances_sf(float(np.mean(white**2)), c.size, dof or np.inf) > chance:
        raise InputError(
            f"{source}, column 'output': it does not follow the table rate, its slopes can't be told from 0; "
            "check which column is the output, and that the gyro was on"
        )


def check_order(
    c: FloatArray,
    weights: FloatArray,
    angles_deg: Sequence[float],
    dof: int,
    source: str,
    *,
    doubt: float = 1e-3,
    fits: float = 0.01,
) -> tuple[float | None, tuple[str, ...]]:
    """Hold the stated turns of the states against what the turns of the table gave.

    All states share the fixture and its zero error, so states turned by half a turn have the same sum of
    angles: that tells which states are opposite. Which way round the states go, and where x is, leaves no
    trace in the data and is taken as stated.

    Parameters
    ----------
    c, weights, angles_deg
        As in :func:`solve`, the weights in standard errors of ``c``.
    dof
        Degrees of freedom behind the weights; 0 where they are those of round-off alone.
    source
        For the message.
    doubt
        Probability of the misfit under which the stated order is doubted.
    fits
        Probability over which another order fits. One that fits less well still counts where its squares
        are smaller by more than a ratio of two chance squares is once in `fits` cases (one redundancy is
        of first order in the misalignment): then both hold errors beyond the noise.

    Returns
    -------
    p_value
        Of the states' disagreement under the stated order; None where no noise is known.
    notes
        What to mind.

    Raises
    ------
    InputError
        If the output does not follow the table rate, or the turns contradict the order of the states.
    """
    _check_follows(c, weights, dof, source)
    _, c, weights = _of_size_1(c, weights)
    common = np.ones((len(STATES), 1))
    redundant = 2 * len(STATES) - 4

    def chance(squares: float) -> float:
        return variances_sf(squares / redundant, redundant, dof or np.inf)

    *_, left = _fitted(c, weights, angles_deg, common)
    p_value = chance(left)
    if p_value >= doubt:
        return p_value if dof else None, ()
    others = []
    for turns in permutations(angles_deg):
        *_, squares = _fitted(c, weights, turns, common)
        # Of orders that fit alike, the one that leaves most states as they were stated.
        others.append((squares, sum(a != b for a, b in zip(turns, angles_deg)), turns))
    best = min(squares for squares, _, _ in others)
    alike = [(moved, turns) for squares, moved, turns in others if squares <= best * 1.01 + 1e-9 * left]
    better = left > best * variances_isf(fits, 1, 1)
    if better or (dof and chance(best) > fits):
        turns = min(alike)[1]
        reverse = tuple((-turn) % 360.0 for turn in turns)
        raise InputError(
            f"{source}: the turns contradict the order of the states: with states 1 to 4 at "
            f"{stated(angles_deg)} deg, clockwise in the mounting plane, opposite states do not share one "
            f"zero error of the fixture; with {stated(turns)} or {stated(reverse)} deg they do (the data "
            "can't tell the sense). State how each state was turned, in a column 'state_angle [deg]' or as "
            f"--state-angles {','.join(f'{turn:g}' for turn in turns)}"
        )
    if not dof:
        return None, ()
    return p_value, (
        "the states disagree by more than noise, and no other order of them fits: the gyro was not seated "
        f"alike in all of them, or a tilt or a turn is not what is stated (probability {short(p_value, 1)})",
    )


def sense_of(angles_deg: Sequence[float]) -> str:
    """What was taken for the turns of the states, and what rests on it."""
    return (
        f"states 1 to 4 taken as turned by {stated(angles_deg)} deg in the mounting plane, clockwise as seen "
        "from +z; turned the other way, delta y changes its sign, which the data can't show"
    )


def stated(angles_deg: Sequence[float]) -> str:
    """Turns as a message says them."""
    return ", ".join(f"{angle:g}" for angle in angles_deg)
