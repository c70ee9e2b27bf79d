"""How far the catalogue's forms alone tell one of its effects from something unknown.

No effect acts by the catalogue's equation to the last per cent, and much that is unknown is like one of its
effects, or like two. Who is to name strong effects, and to name nothing where something unknown acts, has to
draw a line between the two. The oracle here sees what acts without any noise, but does not know the true
forms: of each strong effect that acts alone, and each strong unknown, it has what the catalogue's best form
leaves of it at its best amplitude, a log likelihood ratio between the two forms ::

    L = min_b ||s - C b||^2 / 2     [nats],      E = ||s||^2 / 2

with s whitened by the true noise beside the nominal constants. It takes one effect, or two where the second
one takes so many nats away that it would be named, as anybody has to who is to find two effects; and names
what it took wherever L / E**g is under a limit: g = 0 is a limit in nats, g = 1 one on the share of the
signal. Who asks more of a second effect takes fewer pairs for an unknown, and finds fewer pairs that act.

Coarse sensors count as named: what they truly add is taken from the first reality's own replay, of which the
catalogue's form holds less than of the gap that a diagnosis sees.

``python -m experiments.gap_blind.one_or_unknown DIR/PART`` writes ``one_or_unknown-PART.json`` beside itself,
and ``one_or_unknown.md`` with its figure of every part of the seed that was measured.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from experiments.gap_blind.catalogue_fit import CatalogueFit
from experiments.gap_blind.per_case import HERE, measure_cases, of_seed, true_forms, true_frame, write_page
from experiments.gap_blind.reach import SHOWN_NATS, STRONG, UNKNOWNS, Figure, effects_and_wrong, shown
from experiments.gap_blind.strictness import AS_IT_DOES, by_threshold, marks_of
from experiments.gap_blind.trade import FIRST_WANTED, WRONG_WANTED, Row, best_trade, missed
from fogml.blind.folders import BlindFolder, case_files
from fogml.blind.relatives import relatives_of
from fogml.blind.truth import Truth, read_truth
from fogml.gap.classes import SAME_CLASS_NATS
from fogml.gap.twin_model import TwinModel
from fogml.outputs import whole_file
from fogml.report.static_svg import Curve, line_figure
from fogml.report.style import SERIES
from fogml.report.words import MISSING
from fogml.twin.twin_file import load_twin

SECOND_NATS = (SHOWN_NATS, 12.0, 16.0, 24.0, 40.0, math.inf)
"""What a second effect has to take away; for infinity there is never a second one."""
DRAWN = (SHOWN_NATS, math.inf)
MOST_SHOWN, LEAST_SHOWN = 0.15, 0.85
TWO = Figure("", ("two",), 0.0)
Tables = Mapping[str, Mapping[str, Mapping[str, Any]]]
"""What `by_threshold` gives; empty where the diagnosis's answers are not kept."""


def main() -> None:
    """Measure every case, write the page."""
    seed, found = measure_cases("one_or_unknown", _measured, __doc__, "a suite, or a part of one")
    rows, marks = [row for row in found if row is not None], marks_of(seed)
    diagnosis = by_threshold(marks) if marks else {}
    with whole_file(HERE / "one_or_unknown.svg") as partial:
        partial.write_text(_figure(rows, diagnosis) + "\n", encoding="utf-8")
    write_page("one_or_unknown", _page(rows, of_seed("limits", seed), diagnosis))


def _measured(folder: BlindFolder, name: str) -> Row | None:
    """What the best candidates leave of a strong effect or unknown that acts alone; None of other cases."""
    truth = read_truth(folder.truth / f"{name}.json")
    if truth.kind not in ("one", *UNKNOWNS) or truth.d_prime <= STRONG:
        return None
    (effect,) = truth.effects
    model = TwinModel(load_twin("nominal"), case_files(folder.cases / name).without)
    frame = true_frame(folder, truth, model)
    signal = frame.without_constants(true_forms(folder, truth, frame)[:, 0])
    fit = CatalogueFit(frame, signal, model.candidates(), model.grade)
    row = {"case": name, "kind": truth.kind, "effect": effect.name, "whole": round(fit.energy, 4)}
    return row | sets(fit, truth, relatives_of(folder, truth))


def sets(fit: CatalogueFit, truth: Truth, relative: Callable[[str], bool] | None) -> dict[str, Any]:
    """The best single candidate and the best pair: what they leave [nats], and whether naming them counts.

    For one effect that is whether the right one is named, for an unknown whether a wrong one is.
    """
    singles = fit.singles()

    def judged(ids: Sequence[str], right: bool, left: float) -> dict[str, Any]:
        wrong = any(relative is None or not relative(id) for id in ids)
        counts = right if truth.kind == "one" else wrong
        return {"names": list(ids), "left": round(left, 4), "counts": counts}

    if not singles:
        return {"single": {"names": [], "left": fit.energy, "counts": False}, "pair": None}
    first, id = min(singles, key=singles.__getitem__), str(truth.effects[0].id)
    right = id in singles and singles[id] <= singles[first] + SAME_CLASS_NATS
    pair = fit.pair()
    return {
        "single": judged((first,), right, singles[first]),
        "pair": None if pair is None else judged(pair.ids, id in pair.ids, pair.left),
    }


def sentence(rows: Sequence[Row]) -> str:
    """What one reaches who has the catalogue's forms and no noise, of the two wanted figures together."""
    if len({row["kind"] == "one" for row in rows}) < 2:
        return "Only cases of both kinds, single effects and unknowns, say how far the two are told apart."
    best = [best_trade(rows, second)[1] for second in DRAWN]
    named, named_alone = (held.first_at(WRONG_WANTED) for held in best)
    wrong, wrong_alone = (held.wrong_at(FIRST_WANTED) for held in best)
    return (
        "One who sees without noise what acts, but knows the catalogue's forms alone, and who names a second "
        f"effect that takes {SHOWN_NATS:g} nats away, names {named:.1%} of strong single effects rightly "
        f"where {WRONG_WANTED:.0%} of strong unknowns have a wrong name, and {FIRST_WANTED:.0%} only where "
        f"{wrong:.1%} have one; who never names a second one, {named_alone:.1%}, and {wrong_alone:.1%} "
        "(`one_or_unknown.md`)."
    )


def _page(rows: Sequence[Row], limits: Sequence[Row], diagnosis: Tables) -> str:
    ones = sum(row["kind"] == "one" for row in rows)
    lines = [
        "# One effect of the catalogue, or something unknown",
        "",
        f"Synthetic cases of the first reality with a d′ over {STRONG:g}: {ones} with one effect that acts "
        f"alone, {len(rows) - ones} with an unknown. The oracle sees what acts without noise, E nats, and "
        "knows the catalogue's forms but not the true ones. It takes the candidate that leaves the least, or "
        "two where the second takes enough nats away, and names them wherever what is left, L nats, has "
        "L / E**g under a limit. Limits and g are chosen on these cases themselves. Coarse sensors count as "
        "named.",
        "",
        sentence(rows),
        "",
        "![Effects named against wrong names](one_or_unknown.svg)",
        "",
        *_by_second(rows, limits),
        "",
        *([*_beside_diagnosis(rows, diagnosis), ""] if diagnosis else []),
        *_missed(rows),
    ]
    return "\n".join(lines) + "\n"


def _by_second(rows: Sequence[Row], limits: Sequence[Row]) -> Iterable[str]:
    yield "## What a second effect has to take away"
    yield ""
    yield (
        "The more it has to, the fewer pairs are taken for an unknown, and the fewer pairs that act are "
        "found: the last column has the share of cases with two effects in which each adds so much to the "
        f"evidence (`limits.md`). Effects named are those at wrong names of {WRONG_WANTED:.0%}, wrong names "
        f"those at {FIRST_WANTED:.0%} of effects named."
    )
    yield ""
    yield "| second effect | g | single effects named | wrong names | two effects within reach |"
    yield "|---|---:|---:|---:|---:|"
    effects, _ = effects_and_wrong(limits)
    for second in SECOND_NATS:
        g, held = best_trade(rows, second)
        two = shown(effects, TWO, second) if math.isfinite(second) else None
        named, wrong = held.first_at(WRONG_WANTED), held.wrong_at(FIRST_WANTED)
        reach = MISSING if two is None else f"{two.allowed:.1%}"
        yield f"| {_words(second)} | {g:g} | {named:.1%} | {wrong:.1%} | {reach} |"


def _beside_diagnosis(rows: Sequence[Row], diagnosis: Tables) -> Iterable[str]:
    yield "## The diagnosis beside it"
    yield ""
    yield (
        "Effects named first, where as many unknowns have a wrong name: by the diagnosis, which has the "
        "noise to bear with, and by oracles."
    )
    yield ""
    yield f"| the diagnosis names from | wrong names | it names | {' | '.join(map(_oracle, DRAWN))} |"
    yield f"|---|---:|---:|{'---:|' * len(DRAWN)}"
    best = [best_trade(rows, second)[1] for second in DRAWN]
    for words, figures in diagnosis.items():
        wrong, first = _point(figures)
        theirs = " | ".join(f"{held.first_at(wrong):.1%}" for held in best)
        yield f"| {words} | {wrong:.1%} | {first:.1%} | {theirs} |"


def _missed(rows: Sequence[Row]) -> Iterable[str]:
    yield f"## Effects that the oracles miss at wrong names of {WRONG_WANTED:.0%}"
    yield ""
    yield f"| effect | {' | '.join(map(_oracle, DRAWN))} | of |"
    yield f"|---|{'---:|' * len(DRAWN)}---:|"
    count = Counter(row["effect"] for row in rows if row["kind"] == "one")
    lost = [missed(rows, second, WRONG_WANTED) for second in DRAWN]
    for effect in sorted(lost[0] | lost[1], key=lambda e: (-lost[0][e], e)):
        yield f"| {effect} | {' | '.join(str(held[effect]) for held in lost)} | {count[effect]} |"


def _words(second: float) -> str:
    return f"from {second:g} nats" if math.isfinite(second) else "never"


def _oracle(second: float) -> str:
    return f"oracle, second effect {_words(second)}"


def _point(figures: Mapping[str, Mapping[str, Any]]) -> tuple[float, float]:
    """Wrong names for unknowns, and single effects that the diagnosis names first."""
    return figures["unknown_wrong_name"]["value"], figures["one_top"]["value"]


def _figure(rows: Sequence[Row], diagnosis: Tables) -> str:
    curves = []
    for second, colour, dash, words in zip(DRAWN, SERIES, ("", "6 3"), ("one or two names", "never two")):
        _, held = best_trade(rows, second)
        near = (held.wrong <= MOST_SHOWN) & (held.first >= LEAST_SHOWN)
        if near.any():
            shares = 100 * held.wrong[near], 100 * held.first[near]
            curves.append(Curve(*shares, colour, dash, label=f"oracle, {words}"))
    if diagnosis:
        points = sorted(_point(figures) for words, figures in diagnosis.items() if words != AS_IT_DOES)
        wrong, first = (100.0 * np.array([point[i] for point in points]) for i in (0, 1))
        curves.append(Curve(wrong, first, SERIES[2], "1 2", label="diagnosis, by threshold", dots=True))
    wanted = (np.array([100.0 * WRONG_WANTED]), np.array([100.0 * FIRST_WANTED]))
    curves.append(Curve(*wanted, SERIES[6], label="wanted", dots=True))
    return str(
        line_figure(
            curves,
            "strong unknowns with a wrong name [%]",
            "strong single effects named [%]",
            "Effects named rightly against wrong names for unknowns, by oracles and by the diagnosis",
            height=280,
        )
    )


if __name__ == "__main__":
    main()
