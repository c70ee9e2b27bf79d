"""Whitening of series and regressors by a noise model, exact, in time linear in samples.

The innovations of the model's Kalman filter over their standard deviations are what the inverse
Cholesky factor of the noise's covariance makes of a series (R. E. Kalman 1960; F. C. Schweppe, IEEE
Trans. IT-11 (1965) 61). The gains do not depend on the data: they are found once, at true times, and
serve any number of columns.
"""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray, IntArray
from fogml.errors import InputError
from fogml.signals.clock import Clock
from fogml.signals.noise_model import ADJOINING, Ladder, NoiseModel
from fogml.signals.whitening_kernels import adjoint_kernel, gains_kernel, whiten_kernel

_ROUNDING = 1e-6
"""Steps are told apart to this share of the averaging time."""
_BLOCK = 1 << 19
"""Values worked at a time: 4 MiB."""


class Whitener:
    """Whitens series sampled at given times.

    Parameters
    ----------
    model
        The noise.
    time
        Sample times [s], shape (n,), strictly increasing, with gaps and at any steps.
    averaging_s
        What samples are means over [s], a number or shape (n,); the median step if None. Where a
        step is shorter, slow noise is averaged over the step; white noise always over this.
    ladder
        Flicker states; those of `NoiseModel.ladder` for the length of `time` if None.

    Attributes
    ----------
    log_det
        Half the logarithm of the determinant of the noise's covariance, in (deg/h)^2: noise e has the
        log-likelihood ``-0.5 * sum(whiten(e)**2) - log_det - 0.5 * n * log(2 pi)``.
    deviation
        Standard deviation of each sample given those before [deg/h], shape (n,).

    Raises
    ------
    InputError
        If times do not increase, or an averaging time is not positive.

    Notes
    -----
    Gauss-Markov states start at rest in the statistical sense, the random walk at 0 where the first
    mean begins; a constant of the series is to be among the regressors. Steps are told apart to a
    millionth of the averaging time. Memory is 8 bytes a state and sample; three times that where no
    two steps are alike.
    """

    def __init__(
        self,
        model: NoiseModel,
        time: ArrayLike,
        averaging_s: ArrayLike | None = None,
        ladder: Ladder | None = None,
    ) -> None:
        times = np.ascontiguousarray(time, dtype=np.float64)
        self.averaging_s = _checked_averaging(times, averaging_s)
        typical = float(np.median(self.averaging_s))
        length = float(times[-1] - times[0]) + typical
        self._kinds = _kinds(times, self.averaging_s, typical)
        self._tell_gains(model, model.ladder(typical, length) if ladder is None else ladder)

    def with_noise(self, model: NoiseModel) -> Whitener:
        """A whitener of the same samples and flicker states for other noise."""
        other = copy(self)
        other._tell_gains(model, self.ladder)
        return other

    def _tell_gains(self, model: NoiseModel, ladder: Ladder) -> None:
        self.model, self.ladder = model, ladder
        self._kind, steps, averaging = self._kinds
        states = len(self.ladder.time_constants_s) if model.B > 0.0 else 0
        size = states + (2 if model.Q > 0.0 else 1 if model.K > 0.0 else 0)
        n = len(self._kind)
        self._decay, self._reading = np.zeros((len(steps), size)), np.zeros((len(steps), size))
        self._gains, self.deviation = np.zeros((n, size)), np.zeros(n)
        gains_kernel(
            self._kind,
            steps,
            averaging,
            self.ladder.time_constants_s[:states],
            model.state_variance(self.ladder),
            model.fast_density(self.ladder),
            model.walk_rate,
            3600.0 * model.Q,
            ADJOINING,
            size,
            self._decay,
            self._reading,
            self._gains,
            self.deviation,
        )
        self.log_det = float(np.sum(np.log(self.deviation)))

    def __len__(self) -> int:
        return len(self._kind)

    def whiten(self, values: ArrayLike) -> FloatArray:
        """Whitened columns: independent and of variance 1 for noise of the model.

        Parameters
        ----------
        values
            Shape (n,) or (n, k), in deg/h.

        Raises
        ------
        InputError
            If the number of rows is another one, or a value is not finite.
        """
        return self._through(np.asarray(values, dtype=np.float64), inverse=False)

    def colour(self, white: ArrayLike) -> FloatArray:
        """The inverse of `whiten`: noise of the model [deg/h] from independent standard normal numbers."""
        return self._through(np.asarray(white, dtype=np.float64), inverse=True)

    def colour_adjoint(self, values: ArrayLike) -> FloatArray:
        """The transpose of `colour`, which after it multiplies by the noise's covariance C.

        ``colour(colour_adjoint(v))`` is ``C v``, and ``sum(colour_adjoint(v)**2)`` is ``v' C v``.
        """
        out, columns, costates = self._copied(np.asarray(values, dtype=np.float64))
        adjoint_kernel(columns, self._kind, self._decay, self._reading, self._gains, self.deviation, costates)
        return out

    def _copied(self, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A copy to work in, its columns, and states at rest for them."""
        if values.ndim not in (1, 2) or len(values) != len(self):
            raise InputError(
                f"whitening: values of shape {values.shape}, ({len(self)},) or ({len(self)}, k) was expected"
            )
        out = np.array(values, order="C")
        columns = out if out.ndim == 2 else out[:, None]
        return out, columns, np.zeros((self._gains.shape[1], columns.shape[1]))

    def _through(self, values: FloatArray, *, inverse: bool) -> FloatArray:
        """A copy, worked in pieces that fit the cache."""
        out, columns, states = self._copied(values)
        rows = max(_BLOCK // max(columns.shape[1], 1), 1)
        for low in range(0, len(columns), rows):
            here = slice(low, min(low + rows, len(columns)))
            whiten_kernel(
                columns[here],
                self._kind[here],
                self._decay,
                self._reading,
                self._gains[here],
                self.deviation[here],
                states,
                inverse,
            )
            # What is not finite stays in the states, if there are any.
            if not np.all(np.isfinite(states if len(states) else columns[here])):
                raise InputError(
                    f"whitening: a value among rows {here.start} to {here.stop - 1} is not finite; "
                    "leave such rows out, the times then hold a gap"
                )
        return out


def _checked_averaging(time: FloatArray, averaging_s: ArrayLike | None) -> FloatArray:
    if time.ndim != 1 or len(time) == 0 or not np.all(np.isfinite(time)):
        raise InputError("whitening: finite sample times of one dimension, at least one, were expected")
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if len(back):
        raise InputError(f"whitening: time does not increase at row {back[0] + 1} ({time[back[0] + 1]:g} s)")
    if averaging_s is None:
        if len(time) < 2:
            raise InputError("whitening: the averaging time of a single sample is needed")
        averaging_s = Clock(time).sample_s
    averaging = np.asarray(averaging_s, dtype=np.float64)
    if averaging.shape not in ((), time.shape) or not np.all(np.isfinite(averaging) & (averaging > 0.0)):
        raise InputError(
            f"whitening: averaging times must be positive, one or {len(time)}, not {averaging.shape}"
        )
    return np.broadcast_to(averaging, time.shape)


def _kinds(
    time: FloatArray, averaging: FloatArray, typical: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Which pair of step and averaging time each sample has, and those pairs."""
    quantum = _ROUNDING * typical
    # The first sample's step is its own averaging time: nothing came before.
    steps = np.rint(np.diff(time, prepend=time[0] - averaging[0]) / quantum)
    np.maximum(steps, 1.0, out=steps)
    lengths = np.rint(averaging / quantum)
    pairs = steps if np.all(lengths == lengths[0]) else steps + 1j * lengths
    distinct, kind = np.unique(pairs, return_inverse=True)
    apart = np.full(len(distinct), lengths[0]) if pairs is steps else distinct.imag
    return kind.astype(np.int64), quantum * distinct.real, quantum * apart
