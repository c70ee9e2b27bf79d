"""An azimuth from recorded positions: what is told of it, its standard error, what to mind."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fogml.arrays import BoolArray, FloatArray, IndexArray
from fogml.lab.north import DriftError, horizontal_rate
from fogml.lab.north_schemes import wrapped
from fogml.numerals import short, with_error
from fogml.runs.run import Run
from fogml.runs.settling import LEAST_ROWS, unsettled_rows

ANY_DEG = 180.0 / float(np.sqrt(3.0))
"""Root mean square error of an azimuth that may be any."""
_NODES = 40
"""Nodes a side of the Gauss-Hermite rule over the plane of cosine and sine."""
_NO_NORTH = 5.99
"""Square of a normalised distance that two normal numbers exceed once in 20: chi-square of 2."""
_BEND_SHOWS = 2.58
"""Standard errors that a normal number exceeds once in 100."""
_LAST_DIGIT_DEG = 1e-5
"""Of an azimuth as it is printed; what moves it by less is nothing."""


@dataclass(frozen=True)
class NorthFix:
    """An azimuth from recorded positions.

    Attributes
    ----------
    azimuth_deg, se_deg
        Azimuth clockwise from north of the input axis in the first angle's position, and its standard
        error under the gyro's own noise [deg]; None where the samples are too few to tell that.
    method
        ``plain``, ``drift-observing``, ``bend-observing``, or ``averaged``.
    plain_deg, observed_deg, bent_deg
        Results with a constant bias, one that drifts and one that bends [deg]; None where the positions do
        not tell the drift or the bend.
    drift_deg_h_h, drift_se
        Linear drift seen [deg/h per h] and its standard error; None where they do not tell it.
    bend_deg_h_h2, bend_se
        Coefficient of the time squared [deg/h per h^2] and its standard error, the same.
    bend_probability
        Share of results with a bend in one that is averaged; None of others.
    horizontal_deg_h
        Horizontal Earth rate that the positions show [deg/h].
    offset_deg_h
        Bias [deg/h].
    error
        What the drift that was seen, or a small one where none was, does to the plain result.
    means_deg_h, times_s, positions
        Each stay's mean, middle time and position, each of shape (m,).
    noise_deg_h
        Standard deviation of one sample within the stays; None where there is one sample only.
    notes
        What to mind.
    """

    azimuth_deg: float
    se_deg: float | None
    method: str
    plain_deg: float
    observed_deg: float | None
    bent_deg: float | None
    drift_deg_h_h: float | None
    drift_se: float | None
    bend_deg_h_h2: float | None
    bend_se: float | None
    bend_probability: float | None
    horizontal_deg_h: float
    offset_deg_h: float
    error: DriftError
    means_deg_h: FloatArray
    times_s: FloatArray
    positions: FloatArray
    noise_deg_h: float | None
    notes: tuple[str, ...] = ()


def azimuth_se(found: FloatArray, covariance: FloatArray | None) -> float | None:
    """Root mean square of the azimuth's error on the circle [deg]; `ANY_DEG` where no Earth rate shows.

    Parameters
    ----------
    found
        H cos(theta) and H sin(theta) first [deg/h].
    covariance
        Of ``found``.
    """
    if covariance is None:
        return None
    if float(found[:2] @ np.linalg.pinv(covariance[:2, :2]) @ found[:2]) < _NO_NORTH:
        return ANY_DEG
    nodes, weights = np.polynomial.hermite_e.hermegauss(_NODES)
    weights = weights / weights.sum()
    values, vectors = np.linalg.eigh(covariance[:2, :2])
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    c, s = found[:2, None, None] + np.einsum("ij,jab->iab", root, np.array(np.meshgrid(nodes, nodes)))
    off = np.angle((c + 1j * s) * complex(found[0], -found[1]))
    return float(np.degrees(np.sqrt(weights @ off**2 @ weights)))


@dataclass(frozen=True)
class LeftIn:
    """The next power of time, which a result leaves in: its coefficient, and the azimuth without it [deg]."""

    value: float
    se: float | None
    azimuth_deg: float
    azimuth_se_deg: float | None


def fix_notes(fix: NorthFix, covariance: FloatArray | None, left: LeftIn | None) -> list[str]:
    """Notes on what the samples do not tell, and on a bias that bends otherwise than is taken out."""
    told = []
    if fix.drift_deg_h_h is None:
        told.append("the positions don't tell a drift: the standard error holds without one")
    if covariance is None:
        told.append("no standard error: the samples in each position are too few, or hold no noise")
        return told
    if fix.se_deg == ANY_DEG:
        told.append(
            f"the positions don't tell north: the Earth rate that they show, {short(fix.horizontal_deg_h)} "
            "deg/h, is within its noise; stay longer in each"
        )
    if left is None or not left.se:
        return told
    shows = abs(left.value) / left.se
    without = fix.bent_deg if fix.method == "averaged" and fix.bent_deg is not None else fix.azimuth_deg
    moved = float(abs(wrapped(left.azimuth_deg - without)))
    if not (shows > _BEND_SHOWS and moved > _LAST_DIGIT_DEG):
        return told
    if fix.method == "averaged":
        told.append(
            f"the bias bends otherwise than a square of time ({shows:.1f} standard errors): what goes beyond "
            "a cube the azimuth's standard error does not hold; seek again when the gyro has warmed up"
        )
    else:
        straight = fix.method != "bend-observing"
        how = "" if straight else " otherwise than a square of time"
        which = "the bend taken out (--method bend-observing)" if straight else "a cube of time taken out"
        told.append(
            f"the bias bends{how} during the seek, as at start-up ({shows:.1f} standard errors), which the "
            f"azimuth's standard error does not hold: with {which} it is "
            f"{with_error(left.azimuth_deg, left.azimuth_se_deg)} deg"
        )
    return told


def set_up_notes(
    run: Run, fix: NorthFix, covariance: FloatArray | None, latitude_deg: float | None
) -> list[str]:
    """Notes where the stated set-up and what the positions show part."""
    told = []
    axis, latitude = run.facts.input_axis, run.facts.latitude if latitude_deg is None else latitude_deg
    if axis in ("up", "down"):
        told.append(
            f"the side file says that the input axis points {axis}: north is sought with a level one, and of "
            "a vertical one the azimuth means nothing"
        )
    if latitude is None:
        return [
            "no latitude is stated: the horizontal Earth rate is the one seen, "
            f"{short(fix.horizontal_deg_h, 4)} deg/h",
            *told,
        ]
    expected = horizontal_rate(latitude)
    tolerance = 0.02 * expected
    if covariance is not None:
        tolerance += 5.0 * float(np.sqrt(covariance[:2, :2].trace()))
    if abs(fix.horizontal_deg_h - expected) > tolerance:
        told.append(
            f"the positions show {short(fix.horizontal_deg_h, 4)} deg/h of Earth rate, {short(expected, 4)} "
            f"deg/h were expected at latitude {latitude:g} deg: the axis is not level, the scale factor is "
            "off, or the positions are not what they are called"
        )
    return told


def angle_notes(
    run: Run, times_s: FloatArray, turned_deg: FloatArray, tolerance_deg: float, azimuth_deg: float
) -> list[str]:
    """A note where the table's angle goes another way than the positions say, or alone tells them.

    Parameters
    ----------
    run
        With a column ``position``, ``angle``, or both.
    times_s
        Middle of each stay.
    turned_deg
        Angle of its position, clockwise.
    tolerance_deg
        How far the table may be from it.
    azimuth_deg
        What was found. An angle that counts the other way mirrors it, and the output can't tell.
    """
    if "angle" not in run.columns:
        return []
    if "position" not in run.columns:
        return [
            "the table's angle alone tells the positions, and is taken to count counter-clockwise, seen from "
            f"above: of one that counts clockwise the azimuth is {-azimuth_deg % 360.0:.2f} deg, which the "
            "output can't show"
        ]
    # The table's angle counts counter-clockwise.
    recorded = -np.interp(times_s, run.time, run.columns["angle"])
    recorded, turned = recorded - recorded[0], turned_deg - turned_deg[0]

    def off(way: float) -> FloatArray:
        return np.abs(wrapped(recorded - way * turned))

    worst = int(np.argmax(off(1.0)))
    if off(1.0)[worst] <= tolerance_deg:
        return []
    other = np.all(off(-1.0) <= tolerance_deg)
    return [
        f"the positions say that the gyro stood {turned[worst]:g} deg clockwise of the first at "
        f"{times_s[worst]:.0f} s, the table's column 'angle', which counts counter-clockwise, says "
        f"{recorded[worst]:g} deg: "
        + ("the other --sense, or an angle of the other sign" if other else "check --sense and --order")
    ]


def standing(
    time: FloatArray, gyro: FloatArray, stay: IndexArray, share: float = 1e-3
) -> tuple[BoolArray, tuple[str, ...]]:
    """Samples but those at begins and ends of stays in which all together show the way between positions.

    More than a `share` of the steps of the output: a table's clock is early or late by more than hundredths
    of a sample, and a bias bends by less. Something of each stay is kept.

    Parameters
    ----------
    time, gyro, stay
        Time [s], output [deg/h] and number of the stay of each sample, from 0 on, shape (n,).
    share
        Of a step, what may lack.

    Returns
    -------
    standing, notes
        A mask, shape (n,), and what to mind.
    """
    edges = np.concatenate([[0], np.flatnonzero(np.diff(stay)) + 1, [len(stay)]])
    levels = np.array([np.median(gyro[a:b]) for a, b in pairwise(edges.tolist())])
    every = (len(gyro), len(gyro))
    steps = np.diff(levels)
    begins, ends = unsettled_rows(gyro, edges[:-1], edges[1:], steps, (0, 0), every, (share, share))
    length = np.diff(edges)[stay]
    row, most = np.arange(len(stay)) - edges[stay], (length - LEAST_ROWS) // 2
    out = (row < np.minimum(begins, most)) & (stay > 0)
    out |= (length - row <= np.minimum(ends, most)) & (stay < stay[-1])
    if not out.any():
        return ~out, ()
    step_s, longest = float(np.median(np.diff(time))), int(most.max())
    told = {"first": min(begins, longest), "last": min(ends, longest)}
    left_out = [f"the {end} {short(rows * step_s, 3)} s" for end, rows in told.items() if rows]
    return ~out, (
        f"{' and '.join(left_out)} of a position are left out: the output shows the way between positions "
        "there, as where the table's clock is early or late beside the gyro's",
    )
