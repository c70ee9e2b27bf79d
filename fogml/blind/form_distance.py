"""How near the catalogue's form of each true effect comes to the form that a reality gave it.

Realities know no catalogue, and no form of theirs is taken or left for what is measured here: it is written
into the truth afterwards, so that figures can stand by it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from fogml.blind.folders import BlindFolder, case_files
from fogml.blind.relatives import Likeness
from fogml.blind.sums import write_sums
from fogml.blind.truth import Truth, read_contributions, read_truth, write_truth
from fogml.processes import in_processes


def measure_forms(
    folder: BlindFolder, workers: int = 1, progress: Callable[[int, int], None] | None = None
) -> int:
    """Write the cosine of every effect of the library into its truth; returns how many cases were measured.

    Cases that were measured before are left as they are. The truths are hashed anew.
    """
    paths = [folder.truth / f"{name}.json" for name in folder.names()]
    open_ = [path for path in paths if _is_open(read_truth(path))]
    for done, _ in enumerate(in_processes(partial(_measure, folder), open_, workers), 1):
        if progress:
            progress(done, len(open_))
    if open_:
        write_sums(folder.truth)
    return len(open_)


def _is_open(truth: Truth) -> bool:
    return any(effect.id is not None and effect.cosine is None for effect in truth.effects)


def _measure(folder: BlindFolder, path: Path) -> None:
    truth = read_truth(path)
    given = read_contributions(path.with_suffix(".npz"))
    runs = case_files(folder.cases / truth.case).fit
    contributions = [[given[run.name, place] for run in runs] for place in range(len(truth.effects))]
    likeness = Likeness(runs, contributions, truth.noise_model, truth.nominal)
    effects = tuple(
        effect if effect.id is None else effect.model_copy(update={"cosine": likeness.cosine(effect.id, of)})
        for of, effect in enumerate(truth.effects)
    )
    write_truth(folder.truth, truth.model_copy(update={"effects": effects}), given)
