"""What every sweep tries first: the default polynomial, and what `auto` makes of the training runs."""

from __future__ import annotations

from collections.abc import Sequence

from fogml.models.auto import AutoModel
from fogml.models.names import make_model
from fogml.runs.run import Run
from fogml.tuning.space import Choice

DEFAULT, AUTO = "default", "auto"


def reference_choices(runs: Sequence[Run], seed: int = 0) -> dict[str, Choice]:
    """The choices that a sweep's winner is held against, by name.

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
    made = AutoModel(seed=seed).fit(runs).weighed_
    return {
        DEFAULT: Choice("polynomial", str(features), {}),
        AUTO: Choice("auto", ", ".join(made.model.feature_names), {}, made),
    }
