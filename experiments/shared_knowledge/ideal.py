"""What the best possible check of a short run could tell of an odd unit.

It knows what no laboratory knows: from which distribution the fleet's constants are drawn, from
which one the odd units', and the noise. Of the rows it takes the likelihood ratio of the two. No other
check that leaves as many ordinary units to themselves finds more odd ones of that width (J. Neyman &
E. Pearson, Phil. Trans. R. Soc. A 231 (1933) 289).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from experiments.shared_knowledge.units import MEAN, NOISE, SAMPLE_S, SPREAD, TRAIN_RATE
from experiments.synthetic_world import World, block_rate, cycle
from fogml.arrays import FloatArray
from fogml.runs.run import Run

_CENTRE = np.array([*MEAN["polynomial"], MEAN["rate"], MEAN["product"]])
_WIDTH = np.array([*SPREAD["polynomial"], SPREAD["rate"], SPREAD["product"]])


def nats_for_odd(run: Run, hours: float, far: float) -> float:
    """Logarithm of a training run's likelihood if its unit is odd, over that if it is one of the fleet.

    Parameters
    ----------
    run
        The first hours of a cycle at `TRAIN_RATE`.
    hours
        How many.
    far
        Width of the odd units' distribution over the fleet's.
    """
    columns = _columns(hours)
    left = (run.gyro - columns @ _CENTRE) / NOISE
    scaled = columns * _WIDTH / NOISE
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    return _log_likelihood(values, vectors.T @ (scaled.T @ left), far) - _log_likelihood(
        values, vectors.T @ (scaled.T @ left), 1.0
    )


def _log_likelihood(values: FloatArray, seen: FloatArray, far: float) -> float:
    """Of rows ``N(0, I + far**2 Z Z')``, but for what does not depend on `far`."""
    grown = 1.0 + far**2 * np.maximum(values, 0.0)
    return float(0.5 * np.sum(far**2 * seen**2 / grown) - 0.5 * np.sum(np.log(grown)))


@lru_cache(maxsize=16)
def _columns(hours: float) -> FloatArray:
    """What each of the six constants is multiplied by in a run, shape (n, 6)."""
    world = World(noise=0.0, gradient=0.0)
    quiet, _ = world.run(cycle(TRAIN_RATE, SAMPLE_S, hours), SAMPLE_S, 0, "run.csv")
    inner = quiet.columns["T_in"]
    apart = inner - 25.0
    slope = block_rate(inner, quiet.time, world.window_s)
    return np.column_stack([np.ones_like(apart), apart, apart**2, apart**3, slope, apart * slope])
