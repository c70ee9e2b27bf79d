"""Leaves out with a library effect what can't be told from it.

A relative that stays a candidate would be named in its place, rightly, and nothing would be learned
about how an unknown is met. No reality knows a library, so this is a step of its own.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial

from fogml.blind.folders import BlindFolder, read_json
from fogml.blind.relatives import relatives_of
from fogml.blind.truth import Truth
from fogml.outputs import whole_file
from fogml.processes import in_processes

OPTIONS = "options.json"
RELATIVES = "relatives"


def leave_out_relatives(
    folder: BlindFolder, workers: int = 1, progress: Callable[[int, int], None] | None = None
) -> int:
    """Add relatives of left-out effects to every case's ``without``; returns how many cases were changed.

    Cases that were seen before are left as they are.
    """
    names = [name for name in folder.names() if _is_open(folder, name)]
    changed = 0
    for done, more in enumerate(in_processes(partial(_leave_out, folder), names, workers), 1):
        changed += bool(more)
        if progress:
            progress(done, len(names))
    return changed


def _is_open(folder: BlindFolder, name: str) -> bool:
    """Whether something is left out of a case, and its relatives not yet."""
    options = read_json(folder.cases / name / OPTIONS)
    return bool(options.get("without")) and RELATIVES not in options


def _leave_out(folder: BlindFolder, name: str) -> list[str]:
    from fogml.twin.registry import effects

    truth = Truth.model_validate(read_json(folder.truth / f"{name}.json"))
    relative = relatives_of(folder, truth)
    known = {e.id for e in truth.known}
    found = [
        id
        for id, declared in effects().items()
        if declared.candidate
        and relative is not None
        and id not in truth.left_out
        and id not in known
        and relative(id)
    ]
    path = folder.cases / name / OPTIONS
    options = read_json(path)
    options |= {"without": [*options["without"], *found], RELATIVES: found}
    with whole_file(path) as beside:
        beside.write_text(json.dumps(options) + "\n", encoding="utf-8")
    return found
