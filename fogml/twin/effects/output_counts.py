"""The output as whole counts of angle."""

from __future__ import annotations

import numpy as np

from fogml.runs.run import FloatArray
from fogml.twin.effect import LoggerEffect
from fogml.twin.inputs import Inputs
from fogml.twin.quantities import Quantity

_GAP = 1.5
"""Of the sample interval: what is longer is a gap, of which a sample holds no more than the last interval."""


class OutputCounts(LoggerEffect):
    """The gyro gives whole counts of angle, and what is left over goes on into the next sample.

    ::

        count_k = floor(theta_k / q) - floor(theta_k-1 / q),      theta = integral of output and noise

    q, the amplitude, is the angle of a count [arcsec]. Nothing is lost: after n samples the sum of the counts
    is the angle to within one of them, so the mean rate has no error, and a mean over tau resolves q / tau. A
    simulation then records the column ``gyro`` in counts a sample, with the fact ``scale_factor`` = dt / q
    counts per deg/h. Its noise is that of ``quantisation`` with Q = q / sqrt(12), 1 arcsec being 4.85 urad,
    where noise moves the angle by a count or more a sample; with less of it what is left over beats with the
    rate, as that of a true counter does. A twin that counts states no Q.

    Source: derived; IEEE Std 952, annex C (literature), for its noise; ranges are engineering ones.
    """

    id = "output_counts"
    code = "E12"
    title = "Output in counts"
    amplitude = Quantity("amplitude", "arcsec", (0.01, 1.0), (1e-3, 0.1), "q, one count", (0.0, 1e6))
    needs = ()
    conflicts = ("quantisation",)
    sources = ("IEEE Std 952-1997",)
    shows = "whole numbers in the column of the gyro; the Allan deviation at short times, with slope -1"
    shown_on = "rest for an hour"
    confused_with = {
        "quantisation": "that one is its noise alone",
        "angle_random_walk": "the slope of the Allan deviation: -1 here, -1/2 there",
    }
    candidate = False

    def signature(self, inputs: Inputs, **shape: float) -> FloatArray:
        """Zeros: what a count leaves over comes with the next one."""
        return np.zeros(len(inputs))

    def record(self, output: FloatArray, inputs: Inputs, amplitude: float, **shape: float) -> FloatArray:
        """The rate of the counts [deg/h], shape (n,)."""
        if amplitude == 0.0 or len(output) == 0:
            return output
        step = inputs.time - inputs.memory.previous(f"{self.id} time", inputs.time)
        # The first sample is as long as the next one.
        usual = inputs.memory.first(f"{self.id} step", step[1:] if step[0] <= 0.0 else step)
        step = np.where((step > 0.0) & (step <= _GAP * usual), step, usual)
        # 1 deg/h is 1 arcsec per second.
        per_rate = step / amplitude
        angle = inputs.memory.total(f"{self.id} angle", output * per_rate)
        whole = np.floor(angle)
        return (whole - inputs.memory.previous(f"{self.id} whole", whole, 0.0)) / per_rate
