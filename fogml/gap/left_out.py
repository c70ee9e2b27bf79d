"""Doubt for what was left out: a named effect that one which is no candidate may look like.

An effect that is taken off the candidates may act all the same. Where one looks like an effect that is
named, these runs can't say which of the two it is, and what is left out counts as unknown.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fogml.gap.candidate_columns import candidate_columns
from fogml.gap.explanation import Explanation
from fogml.gap.frame import Frame
from fogml.gap.model import Candidate
from fogml.gap.result import Found, Unknown
from fogml.gap.screening import Screening
from fogml.gap.search import Search
from fogml.gap.unlike import RELATIVE
from fogml.runs.run import FloatArray


def with_look_alikes(
    search: Search, best: Explanation, found: Sequence[Found], left_out: Mapping[str, Candidate], grade: str
) -> tuple[Found, ...]:
    """What was found, with the left-out effects that each named one can't be told from by its signature.

    Parameters
    ----------
    search, best
        The search and its best explanation, of whose effects the signatures are.
    found
        What was found.
    left_out
        Effects that are no candidates.
    grade
        Whose ranges are usual.
    """
    if not left_out or not any(f.named for f in found):
        return tuple(found)
    frame, signatures = search.field_.basis.frame, _signatures(search, best)
    screening = Screening(frame, [])
    nodes = {
        id: [columns for _, columns in candidate_columns(declared, frame, grade, screening)]
        for id, declared in left_out.items()
    }
    told = []
    for f in found:
        alike: tuple[str, ...] = ()
        if f.named and f.effect in signatures:
            signature = signatures[f.effect]
            alike = tuple(id for id, held in nodes.items() if _cosine(frame, signature, held) > RELATIVE)
        told.append(replace(f, left_out=alike))
    return tuple(told)


def doubted(unknown: Unknown, found: Sequence[Found]) -> Unknown:
    """The unknown, at least as probable as that a left-out look-alike acts in the place of a named effect.

    All look-alikes count as likely as each member of the class.
    """
    shares = [f.probability * len(f.left_out) / len({*f.members, *f.left_out}) for f in found if f.left_out]
    if not shares:
        return unknown
    doubt = 1.0 - math.prod(1.0 - share for share in shares)
    names = ", ".join(dict.fromkeys(id for f in found for id in f.left_out))
    words = f"may be {names}, left out of the candidates, in place of what is named"
    if unknown.probability > doubt and unknown.looks_like:
        words = f"{unknown.looks_like}; {words}"
    return replace(unknown, probability=1.0 - (1.0 - unknown.probability) * (1.0 - doubt), looks_like=words)


def _signatures(search: Search, best: Explanation) -> dict[str, FloatArray]:
    """What each effect of an explanation does on the runs, whitened, shape (n, 1)."""
    field, terms = search.field_, search.terms(best)
    mean, _ = field.condition(terms).coefficients()
    coefficients = dict(zip([c for t in terms for c in t.columns], mean))
    places = {c.candidate: field.basis.nodes[c.node].columns for c in best.effects}
    return {
        id: field.columns(held) @ np.array([[coefficients[c]] for c in held]) for id, held in places.items()
    }


def _cosine(frame: Frame, signature: FloatArray, nodes: Sequence[FloatArray]) -> float:
    """Greatest cosine of a whitened signature, shape (n, 1), with what a node's columns span."""
    best = 0.0
    for columns in nodes:
        gram = frame.beside(np.concatenate([signature, columns], axis=1))
        inner, across = gram[1:, 1:], gram[0, 1:]
        reached = across @ np.linalg.lstsq(inner, across, rcond=1e-6)[0]
        best = max(best, float(reached) / max(float(gram[0, 0]), 1e-300))
    return math.sqrt(min(max(best, 0.0), 1.0))
