"""The values of ``score.json`` from marks, whether they were just made or read from files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import fogml
from fogml.blind.scoring.breakdowns import confusion, left_out, thinned, worst
from fogml.blind.scoring.by_reality import by_form, by_reality
from fogml.blind.scoring.marks import Mark
from fogml.blind.scoring.marks_file import Marks
from fogml.blind.scoring.statistics import Bin
from fogml.blind.scoring.table import BY_KEY, calibration, curve, rows
from fogml.blind.seeds import check_use, record_use, uses
from fogml.blind.truth import KINDS, STRATUM_NAMES

SCHEMA = "fogml.blind_score/1"


def score_values(marks: Marks, final: Path | None = None) -> dict[str, Any]:
    """JSON-ready values of schema ``fogml.blind_score/1``.

    Parameters
    ----------
    marks
        Of every method.
    final
        The ledger of uses of final seeds, to be given where the suite's seed is one; the use is added.

    Raises
    ------
    InputError
        If a final seed is used without the ledger.
    """
    check_use(marks.seed, final)
    truths = marks.truths
    mix = sum(truth.mix for truth in truths)
    found = {name: _method(own if mix else _as_mix(own)) for name, own in marks.methods.items()}
    if final is not None:
        figures = {
            name: {row["key"]: row["value"] for row in values["rows"]} for name, values in found.items()
        }
        record_use(final, marks.seed, len(truths), marks.truth, figures)
    return {
        "schema": SCHEMA,
        "version": fogml.__version__,
        "data": "synthetic: realities written apart from the twin",
        "seed": marks.seed,
        "final": final is not None,
        "final_uses": uses(final) if final is not None else [],
        "truth": marks.truth,
        "parts": [part.model_dump(mode="json") for part in marks.parts],
        "cases": len(truths),
        "mix": mix,
        "realities": _counted([truth.reality for truth in truths]),
        "kinds": _counted([truth.kind for truth in truths], KINDS),
        "strata": _counted([truth.stratum for truth in truths if truth.effects], STRATUM_NAMES),
        "fit_runs": _counted([len(truth.runs.fit) for truth in truths]),
        "turning": sum(truth.turning for truth in truths),
        "sample_s": list(marks.sample_s),
        "methods": found,
        "gates": [],
    }


def _as_mix(marks: Sequence[Mark]) -> list[Mark]:
    """Marks of a suite of nothing but chosen kinds or strata, which is all the mix that it has."""
    return [replace(m, truth=m.truth.model_copy(update={"mix": True})) for m in marks]


def _method(marks: Sequence[Mark]) -> dict[str, Any]:
    return {
        "code": _code_states(marks),
        "by_reality": by_reality(marks),
        "by_form": by_form(marks),
        "rows": rows(marks),
        "reliability": [_bin(part) for part in calibration(BY_KEY["calibration_error"].chosen(marks))],
        "open_set": thinned(curve(BY_KEY["auroc"].chosen(marks))),
        "confusion": confusion(marks),
        "left_out": left_out(marks),
        "worst": worst(marks),
        "failed": [{"case": m.truth.case, "reason": m.failure} for m in marks if m.failure],
    }


def _code_states(marks: Sequence[Mark]) -> list[str | None]:
    """Each state of the code that gave answers; None for answers that do not tell."""
    return sorted({m.code for m in marks if m.code or not m.failure}, key=lambda state: state or "")


def _bin(part: Bin) -> dict[str, Any]:
    return {
        "from": part.low,
        "to": part.high,
        "stated": part.stated,
        "found": part.found.value,
        "low": part.found.low,
        "high": part.found.high,
        "n": part.found.n,
    }


def _counted(values: Sequence[Any], order: Sequence[Any] | None = None) -> dict[str, int]:
    counts = Counter(values)
    return {str(name): counts[name] for name in (order or sorted(counts)) if counts[name]}
