"""Whitening of one run's rows: the gyro's noise, and what the noise of temperature readings adds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fogml.gap.observation import Observation
from fogml.runs.run import FloatArray
from fogml.signals.noise_model import NoiseModel
from fogml.signals.whitening import Whitener

LONGEST_RUNS = 30.0
"""Flicker goes on to this many run lengths: a week or so."""


class RunWhitener:
    """Whitens series over the rows of a run.

    Rows in which the readings' noise matters, such as fast turns with a scale factor that depends on
    temperature, weigh less: readings' noise is white, so it adds to the innovations' variance.

    Parameters
    ----------
    noise
        The gyro's noise.
    o
        The run.
    constants
        At which the readings' noise is taken.
    reading_noise
        What the noise of the readings makes of the replay [deg/h], shape (n,); told from the readings if
        None.
    """

    def __init__(
        self,
        noise: NoiseModel,
        o: Observation,
        constants: Mapping[str, float],
        reading_noise: FloatArray | None = None,
    ) -> None:
        # Flicker slower than a run sets runs of a unit apart by a constant.
        ladder = noise.ladder(o.row_s, LONGEST_RUNS * (float(o.time[-1] - o.time[0]) + o.row_s))
        self._whitener = Whitener(noise, o.time, o.row_s, ladder)
        if reading_noise is None:
            reading_noise = o.model.reading_noise(constants)
        reading = np.sqrt(o.averaged(reading_noise**2) / o.width)
        self.weights: FloatArray = 1.0 / np.sqrt(1.0 + (reading / self._whitener.deviation) ** 2)

    @property
    def log_det(self) -> float:
        """Half the logarithm of the determinant of the rows' covariance, in (deg/h)^2."""
        return self._whitener.log_det - float(np.sum(np.log(self.weights)))

    def whiten(self, values: FloatArray) -> FloatArray:
        """White rows of unit variance, shape as given: (m,) or (m, k)."""
        white = self._whitener.whiten(values)
        return np.asarray(white * (self.weights if white.ndim == 1 else self.weights[:, None]))

    def colour(self, white: FloatArray) -> FloatArray:
        """The inverse of `whiten` [deg/h], shape (m,)."""
        return self._whitener.colour(white / self.weights)
