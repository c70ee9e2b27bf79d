"""What every sweep tries first: the default polynomial, and what `auto` chooses."""

from __future__ import annotations

from collections.abc import Sequence

from fogml.models.names import make_model
from fogml.models.trial import Trial
from fogml.runs.run import Run
from fogml.tuning.space import Choice

DEFAULT, AUTO = "default", "auto"


def reference_choices(runs: Sequence[Run], seed: int = 0) -> dict[str, Choice]:
    """The choices that a sweep's winner is held against, by name; one of both names where they are the same.

    Parameters
    ----------
    runs
        Training runs.
    seed
        Seed of the networks.

    Raises
    ------
    InputError
        If the runs don't belong together, lack a temperature, or are too short.
    """
    features = make_model("polynomial", None, seed).get_params()["features"]
    default = Choice("polynomial", str(features), {})
    trial = Trial(runs, seed)
    found = trial.chosen([trial.score(candidate) for candidate in trial.candidates]).candidate
    kind = "rbf" if found.network else "polynomial"
    auto = Choice(kind, found.features, {}) if found.features else Choice("mean", "", {})
    if auto == default:
        return {f"{DEFAULT}, {AUTO}": default}
    return {DEFAULT: default, AUTO: auto}
