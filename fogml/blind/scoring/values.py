"""The values of ``score.json`` from marks, whether they were just made or read from files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

import fogml
from fogml.blind.plan import check_use, record_use, uses
from fogml.blind.scoring.answers import NAMED
from fogml.blind.scoring.by_reality import by_form, by_reality
from fogml.blind.scoring.marks import Mark
from fogml.blind.scoring.marks_file import Marks
from fogml.blind.scoring.statistics import Bin, proportion
from fogml.blind.scoring.table import BY_KEY, calibration, curve, rows
from fogml.blind.truth import KINDS, STRATUM_NAMES

UNKNOWN, NOTHING = "unknown", "nothing"
WORST = 10
_CURVE_POINTS = 200


def confusion(marks: Sequence[Mark]) -> dict[str, Any]:
    """True effect against what was named, over cases with one missing effect.

    An effect counts as answered by its own name where it is in a named class, else by the name of the
    most certain named item, else as `UNKNOWN` or `NOTHING`. ``in_class`` counts, of the hits, those in
    classes of several.
    """
    chosen = [m for m in marks if m.truth.kind == "one"]
    pairs: Counter[tuple[str, str]] = Counter()
    in_class: Counter[str] = Counter()
    for m in chosen:
        true = m.truth.effects[0].name
        holding = next((item for item in m.named if true in item.members), None)
        if holding is not None:
            pairs[true, true] += 1
            in_class[true] += len(holding.members) > 1
        elif m.named:
            pairs[true, m.named[0].effect] += 1
        elif m.failure:
            pairs[true, "failed"] += 1
        else:
            pairs[true, UNKNOWN if m.unknown >= NAMED else NOTHING] += 1
    true_names = sorted({true for true, _ in pairs})
    others = sorted({named for _, named in pairs} - set(true_names) - {UNKNOWN, NOTHING, "failed"})
    ends = [name for name in (UNKNOWN, NOTHING, "failed") if any(named == name for _, named in pairs)]
    answered = [*true_names, *others, *ends]
    return {
        "true": true_names,
        "answered": answered,
        "counts": [[pairs[true, named] for named in answered] for true in true_names],
        "in_class": [in_class[true] for true in true_names],
    }


def left_out(marks: Sequence[Mark]) -> list[dict[str, Any]]:
    """For each effect that was left out of the candidates, and each invented one: what became of it."""
    rows = []
    chosen = [m for m in marks if m.truth.kind in ("unknown_left_out", "unknown_invented")]
    for name in sorted({m.truth.unknown[0].name for m in chosen if m.truth.unknown}):
        own = [m for m in chosen if m.truth.unknown and m.truth.unknown[0].name == name]
        wrong = Counter(item.effect for m in own for item in m.named if not item.right)
        relatives = Counter(id for m in own for id in m.relatives)
        rows.append(
            {
                "effect": name,
                "in_library": own[0].truth.unknown[0].id is not None,
                "d_prime": float(np.median([m.d_prime for m in own])),
                "flagged": asdict(proportion([m.unknown >= NAMED for m in own])),
                "wrong_name": asdict(proportion([m.wrong_name for m in own])),
                "wrong_names": dict(wrong.most_common()),
                "relatives": dict(relatives.most_common()),
            }
        )
    return rows


def worst(marks: Sequence[Mark], count: int = WORST) -> list[dict[str, Any]]:
    """The cases with the most certain wrong answers, worst first, each with what is wrong."""
    scored = sorted(((_badness(m), m) for m in marks), key=lambda pair: (-pair[0], pair[1].truth.case))
    return [
        {
            "case": m.truth.case,
            "kind": m.truth.kind,
            "stratum": m.truth.stratum,
            "d_prime": m.d_prime,
            "true": [effect.name for effect in m.truth.effects],
            "left_out": [effect.name for effect in m.truth.unknown],
            "named": [{"class": list(i.members), "probability": i.probability} for i in m.named],
            "unknown": None if m.failure else m.unknown,
            "verdict": m.verdict,
            "wrong": _wrong(m),
        }
        for badness, m in scored[:count]
        if badness > 0.0
    ]


def thinned(curve: Any) -> dict[str, list[float]]:
    """A curve's corners in at most so many points that a page can draw it."""
    n = len(curve.false_positive)
    places = np.unique(np.linspace(0, n - 1, min(n, _CURVE_POINTS)).astype(np.intp)).tolist()
    return {
        "false_positive": [float(curve.false_positive[i]) for i in places],
        "true_positive": [float(curve.true_positive[i]) for i in places],
    }


def _badness(m: Mark) -> float:
    """How wrong: certain wrong names first, then what was missed, both by the strength of the effect."""
    if m.failure:
        return 10.0
    wrong = sum(item.probability for item in m.named if not item.right)
    missed = float(bool(m.truth.known) and not m.kept)
    weight = 1.0 if not m.truth.effects else float(np.log2(1.0 + m.d_prime))
    surprise = abs(m.unknown - float(bool(m.truth.unknown))) if m.truth.kind != "wrong_thermal" else 0.0
    return 3.0 * wrong + weight * (0.5 * missed + 0.3 * (surprise if surprise > NAMED else 0.0))


def _wrong(m: Mark) -> str:
    """What is wrong with an answer, in a few words."""
    if m.failure:
        return m.failure
    parts = []
    wrong = [item.effect for item in m.named if not item.right]
    if wrong:
        parts.append(f"names {', '.join(wrong)}")
    held = {id for item in m.named for id in item.members}
    missed = [effect.name for effect in m.truth.known if effect.id not in held]
    if missed:
        parts.append(f"misses {', '.join(missed)}")
    if m.truth.unknown and m.unknown < NAMED:
        parts.append("sees no unknown")
    elif not m.truth.unknown and m.unknown >= NAMED and m.truth.kind != "wrong_thermal":
        parts.append("sees an unknown that is none")
    return "; ".join(parts)


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
        "code": sorted({m.code for m in marks if m.code or not m.failure}, key=lambda state: state or ""),
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
