"""What a reality draws of a unit's set-up and programmes, so that given effects show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fogml.blind.frame.form import Demands, Form
from fogml.blind.frame.record import SetUp


def draw_set_up(
    rng: np.random.Generator,
    forms: Sequence[type[Form]],
    latitudes: tuple[float, float],
    upright: float,
) -> SetUp:
    """Where a unit stands and which way it points.

    Parameters
    ----------
    rng
        Generator that is drawn from.
    forms
        Effects that have to show; some need the axis horizontal, some need it up.
    latitudes
        Range of the latitude [deg].
    upright
        Share of units with the axis up where no effect asks for either.
    """
    latitude = float(rng.uniform(*latitudes))
    if any(f.horizontal for f in forms):
        return SetUp(latitude, float(rng.choice([90.0, 270.0])))
    if any(f.demands.slow_turns for f in forms) or rng.random() < upright:
        return SetUp(latitude, None)
    return SetUp(latitude, float(rng.uniform(0.0, 360.0)))


def draw_demands(
    rng: np.random.Generator,
    forms: Sequence[type[Form]],
    chance: Mapping[str, float],
    top_rates: tuple[float, float],
) -> Demands:
    """What the forms ask of the programmes, and the rest by chance.

    Parameters
    ----------
    rng
        Generator that is drawn from.
    forms
        Effects that have to show. Turns would tell `logger_skew`, and come with it only where asked for.
    chance
        Probability of a demand that none asks for, by its name; 0 unless stated.
    top_rates
        Range of the greatest table rate [deg/s], log-uniform.
    """
    kinds = [name for name, value in vars(Demands()).items() if isinstance(value, bool)]
    by_chance = dict(zip(kinds, rng.random(len(kinds)).tolist()))
    likely = {**chance, "turns": 0.0} if any(f.name == "logger_skew" for f in forms) else chance
    drawn = {
        name: any(getattr(f.demands, name) for f in forms) or by_chance[name] < likely.get(name, 0.0)
        for name in kinds
    }
    return Demands(**drawn, top_rate=float(np.exp(rng.uniform(*np.log(top_rates)))))
