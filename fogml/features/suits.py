"""Whether runs can tell what features ask for: memories within the runs, banks within the recorded range."""

from __future__ import annotations

from collections.abc import Sequence

from fogml.errors import InputError
from fogml.features.atoms import Atom
from fogml.features.features import Features
from fogml.features.signal import TIME_ON
from fogml.numerals import short
from fogml.runs.run import Run


def check_suits(features: Features, runs: Sequence[Run]) -> None:
    """Refuse features that training runs can tell nothing of."""
    for atom in features.atoms:
        told = unsuited(atom, runs)
        if told is not None:
            at = features.text.index(atom.text)
            message, hint = told
            raise InputError(f"{message}\n  {features.text}\n  {' ' * at}^\n{hint}")


def unsuited(atom: Atom, runs: Sequence[Run]) -> tuple[str, str] | None:
    """What is wrong with an atom for training runs, and what to do; None where they suit it."""
    if atom.operator in ("lag", "since_on"):
        longest = max(float(run.time[-1] - run.time[0]) for run in runs)
        coarsest = max(runs, key=lambda run: run.sample_s)
        if atom.memory > longest:
            return (
                f"a time constant of {atom.memory:g} s, but the longest training run is "
                f"{short(longest, 4)} s",
                "record longer, or state a time constant within the runs",
            )
        if atom.operator == "lag" and atom.memory < coarsest.sample_s * (1.0 - 1e-6):
            return (
                f"{coarsest.name}: a time constant of {atom.memory:g} s, but samples are "
                f"{coarsest.sample_s:g} s apart",
                f"state at least {coarsest.sample_s:g} s",
            )
    if atom.operator == "play" and TIME_ON not in atom.signal.sensors:
        values = [atom.signal.values(run) for run in runs]
        span = max(float(v.max()) for v in values) - min(float(v.min()) for v in values)
        if 2.0 * atom.memory > span:
            return (
                f"a half width of {atom.memory:g}, but {atom.signal.text} spans {short(span, 4)} in the "
                "training runs, less than the play",
                f"state at most {short(0.5 * span)}, or train over a wider range",
            )
    return None
