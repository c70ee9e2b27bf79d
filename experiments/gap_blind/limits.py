"""What the data of a suite allow, by likelihood ratios between true forms, and how far the answers are off.

For each effect that acts, ``gain`` is what its true form adds to the evidence of the runs beside the true
forms of whatever else acts, its amplitude alone unknown, beside the nominal constants and the errors of
ordinary sensors with their priors [nats].

For each wrong name, and each effect that was missed, the distance between what truly acts and what was
answered is ``||r||^2 / 2`` nats: r is what the answered effects, at the shapes stated and the best
amplitudes, leave of the true contributions, both whitened by the true noise, beside the nominal constants.
Where the answer says that something unknown acts, what truly is unknown counts as answered. Relatives of
an effect that was left out are no wrong names, as in the score.

``python -m experiments.gap_blind.limits DIR/PART`` writes ``limits-PART.json``
beside itself, and ``limits.md`` of every part of the seed that was measured.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from experiments.gap_blind.per_case import measure_cases, true_forms, true_frame, write_page
from experiments.gap_blind.reach import (
    SHOWN_NATS,
    STRONG,
    UNKNOWNS,
    Figure,
    Row,
    effects_and_wrong,
    false_names,
    open_set_reach,
    shown,
    wrongly_named,
)
from fogml.blind.folders import BlindFolder, case_files
from fogml.blind.relatives import Likeness, relatives_of
from fogml.blind.scoring.answers import read_answer
from fogml.blind.scoring.marks import mark
from fogml.blind.truth import Truth, read_contributions, read_truth
from fogml.gap.frame import Frame
from fogml.gap.twin_model import TwinModel
from fogml.runs.run import FloatArray
from fogml.twin.twin_file import load_twin

TELLING_NATS = 3.0
"""Under so many nats two explanations are one."""
SURE_NATS = 10.0
GAIN_EDGES = (-np.inf, 4.0, 8.0, 12.0, 16.0, 24.0, 40.0, 80.0, np.inf)
KINDS = ("one", "two", "three", "unknown_and_known")
FIGURES = (
    Figure("one effect, d′ over 10: class exact", ("one",), STRONG),
    Figure("one effect, any d′: class exact", ("one",), 0.0),
    Figure("two effects: class exact", ("two",), 0.0),
    Figure("three effects: class exact", ("three",), 0.0),
    Figure("unknown and known: known kept", ("unknown_and_known",), 0.0, alone=False),
    Figure("unknown, d′ over 10: said to be unknown", UNKNOWNS, STRONG, known=False, alone=False),
    Figure("unknown, any d′: said to be unknown", UNKNOWNS, 0.0, known=False, alone=False),
)
WRONG_NAMES = (
    Figure("one effect, d′ over 10", ("one",), STRONG),
    Figure("one effect, any d′", ("one",), 0.0),
    Figure("two effects", ("two",), 0.0),
    Figure("three effects", ("three",), 0.0),
    Figure("unknown, d′ over 10", UNKNOWNS, STRONG),
    Figure("unknown, any d′", UNKNOWNS, 0.0),
    Figure("unknown and known", ("unknown_and_known",), 0.0),
)
GROUPS = ("a wrong name", "an effect missed, nothing wrong named")


def main() -> None:
    """Measure every case that the diagnosis answered; write the tables."""
    found = measure_cases("limits", _measured, __doc__, "an answered suite, or a part of one").cases
    write_page("limits", _page(*effects_and_wrong(found), [case["asked"] for case in found]))


def _measured(folder: BlindFolder, name: str) -> Row:
    """What each effect of a case adds, a wrong answer's distance from the truth, and the unknown's share."""
    truth = read_truth(folder.truth / f"{name}.json")
    answer = read_answer(folder.answers() / name)
    # A case that was not answered says nothing of an unknown.
    asked = {
        "case": name,
        "kind": truth.kind,
        "mix": truth.mix,
        "unknown": answer.gap.unknown.probability if answer.gap else 0.0,
    }
    if answer.gap is None or not truth.effects:
        return {"effects": [], "wrong": None, "asked": asked}
    marked = mark(truth, answer, relatives_of(folder, truth))
    named = [item for item in answer.gap.which if item.named]
    held = {member for item in named for member in item.members}
    unknown = answer.gap.unknown.probability
    wrong = [item.effect for item in marked.named if not item.right]
    effects = [
        {"case": name, "kind": truth.kind, "effect": e.name, "known": e in truth.known}
        | {"d_prime": e.d_prime, "gain": gain, "wrong_beside": bool(wrong)}
        | {"named": e.id in held if e in truth.known else unknown >= 0.5}
        for e, gain in zip(truth.effects, _gains(folder, truth))
    ]
    missed = sorted({e.id for e in truth.known if e.id} - held)
    if not (wrong or missed):
        return {"effects": effects, "wrong": None, "asked": asked}
    row = {"case": name, "kind": truth.kind, "wrong": wrong, "missed": missed, "unknown": unknown}
    ids = {item.effect for item in named}
    row["nats"] = _distance(folder, truth, ids, unknown >= 0.5)
    return {"effects": effects, "wrong": row, "asked": asked}


def _gains(folder: BlindFolder, truth: Truth) -> list[float]:
    """Evidence that each effect's true form adds beside the others [nats]."""
    frame = true_frame(folder, truth, TwinModel(load_twin("nominal")))
    forms = true_forms(folder, truth, frame)
    whole = _log_evidence(frame, forms)
    return [whole - _log_evidence(frame, np.delete(forms, i, axis=1)) for i in range(forms.shape[1])]


def _log_evidence(frame: Frame, forms: FloatArray) -> float:
    """Of the runs, beside constants and sensors' errors; amplitudes about as large as they are."""
    columns = np.concatenate([frame.residual, forms], axis=1)
    inner = frame.beside(columns)
    own, fit = np.eye(forms.shape[1]) + inner[1:, 1:], inner[1:, 0]
    return float(-0.5 * inner[0, 0] + 0.5 * fit @ np.linalg.solve(own, fit) - 0.5 * np.linalg.slogdet(own)[1])


def _distance(folder: BlindFolder, truth: Truth, named: set[str], unknown: bool) -> float:
    given = read_contributions(folder.truth / f"{truth.case}.npz")
    runs = case_files(folder.cases / truth.case).fit
    counted = [i for i, e in enumerate(truth.effects) if not (unknown and e in truth.unknown)]
    if not counted:
        counted = list(range(len(truth.effects)))
    total = [sum(given[run.name, i] for i in counted) for run in runs]
    likeness = Likeness(runs, [total], truth.noise_model, truth.nominal)
    which = json.loads((folder.answers() / truth.case / "gap.json").read_text())["which"]
    shapes = {
        i["effect"]: {k: v["value"] for k, v in i["parameters"].items()}
        for i in which
        if i["effect"] in named
    }
    return 0.5 * likeness.left(shapes)


def _page(everything: Sequence[Row], wrong: Sequence[Row], asked: Sequence[Row]) -> str:
    effects = [row for row in everything if row["known"]]
    lines = [
        "# What the data allow",
        "",
        f"Synthetic cases of the first reality: {len(asked)}, with {len(effects)} known effects.",
        "",
        "## How much of what the data show is named",
        "",
        "Known effects by what the true form of each adds to the evidence beside whatever else truly acts, "
        "the nominal constants and ordinary sensors' errors: the logarithm of the likelihood ratio for one "
        "who knows all forms. Who doesn't, and chooses among 36 effects of unknown size and shape, needs "
        "some 8 nats to name one.",
        "",
        f"| gain in nats | effects | named | {' | '.join(KINDS)} |",
        "|---|---:|---:|" + "---:|" * len(KINDS),
    ]
    for label, low, high in gain_bins():
        inside = [row for row in effects if low <= row["gain"] < high]
        cells = [_share([row for row in inside if row["kind"] == kind]) for kind in KINDS]
        lines.append(f"| {label} | {len(inside)} | {_share(inside)} | {' | '.join(cells)} |")
    lines += [
        "",
        "## What of a figure is within reach",
        "",
        f"Share of cases in which the data show every effect that counts with {SHOWN_NATS:g} nats or more, "
        "and share in which the answer has them all; for a class that is exact, with no wrong name beside.",
        "",
        "| figure | cases | the data show | the answer has |",
        "|---|---:|---:|---:|",
        *(_within_reach(everything, figure) for figure in FIGURES),
        "",
        "## Wrong names that the data could have told",
        "",
        f"Share of cases with a wrong name, and with one that the truth is {SHOWN_NATS:g} nats or more away "
        "from: what is nearer is as good an explanation for one who has to choose.",
        "",
        "| figure | cases | a wrong name | that the data tell |",
        "|---|---:|---:|---:|",
        *(_wrong_names(everything, wrong, figure) for figure in WRONG_NAMES),
        "",
        _false_names(effects, wrong, {row["case"] for row in asked if row["mix"]}),
        "",
        "## How far an unknown can be told from none",
        "",
        f"An unknown that adds less than {SHOWN_NATS:g} nats is hidden: also for one who knows its form it "
        "ranks among the cases without one as chance has it. With a share h hidden and all others told, the "
        "area under the curve is 1 - h / 2, and the threshold that 95 % of the unknowns reach is reached by "
        "a share 1 - 0.05 / h of the cases without one, too.",
        "",
        "Cases of the whole mix alone.",
        "",
        "| unknowns | cases | hidden | AUROC within reach | AUROC | FPR95 within reach | FPR95 |",
        "|---|---:|---:|---:|---:|---:|---:|",
        *(_open_set(everything, asked, above) for above in (0.0, STRONG)),
        "",
        "## How far wrong answers are from the truth",
        "",
        f"{len(wrong)} cases were answered with a wrong name or without an effect that acts. For each the "
        "expected logarithm of the likelihood ratio between the truth and the named effects, for one who "
        f"knows both forms. Under {TELLING_NATS:g} nats nobody can tell the two. Where the answer says that "
        "something unknown acts, what truly is unknown counts as answered.",
        "",
        "| answer | kind | cases | median nats | under 3 | under 10 |",
        "|---|---|---:|---:|---:|---:|",
    ]
    held: dict[tuple[str, str], list[float]] = {}
    for row in wrong:
        held.setdefault((GROUPS[0] if row["wrong"] else GROUPS[1], row["kind"]), []).append(row["nats"])
    for (group, kind), values in sorted(held.items()):
        nats = np.array(values)
        lines.append(
            f"| {group} | {kind} | {len(nats)} | {np.median(nats):.1f} | "
            f"{np.mean(nats < TELLING_NATS):.0%} | {np.mean(nats < SURE_NATS):.0%} |"
        )
    return "\n".join(lines) + "\n"


def gain_bins() -> Iterator[tuple[str, float, float]]:
    """Words for each range of a gain, and its ends [nats]."""
    for low, high in pairwise(GAIN_EDGES):
        words = f"under {high:g}" if low == -np.inf else f"{low:g} to {high:g}"
        yield f"over {low:g}" if high == np.inf else words, low, high


def _share(rows: Sequence[Row]) -> str:
    return f"{np.mean([row['named'] for row in rows]):.2f} of {len(rows)}" if rows else "–"


def _within_reach(effects: Sequence[Row], figure: Figure) -> str:
    found = shown(effects, figure)
    if found is None:
        return f"| {figure.words} | 0 | – | – |"
    return f"| {figure.words} | {found.cases} | {found.allowed:.2f} | {found.reached:.2f} |"


def _wrong_names(effects: Sequence[Row], wrong: Sequence[Row], figure: Figure) -> str:
    found = wrongly_named(effects, wrong, figure)
    if found is None:
        return f"| {figure.words} | 0 | – | – |"
    told = found.reached - found.allowed
    return f"| {figure.words} | {found.cases} | {found.reached:.2f} | {told:.2f} |"


def _false_names(known: Sequence[Row], wrong: Sequence[Row], mix: set[str]) -> str:
    found = false_names(known, wrong, mix)
    false = round(found.cases * found.reached)
    told = found.reached - found.allowed
    return (
        f"In the mix, where something acts, {found.cases - false} effects are named that do act and {false} "
        f"that don't, {found.reached:.1%} of both; {round(found.cases * told)} of these, {told:.1%}, where "
        "the data tell."
    )


def _open_set(effects: Sequence[Row], asked: Sequence[Row], above: float) -> str:
    found = open_set_reach(effects, asked, above)
    words = f"d′ over {above:g}" if above else "any d′"
    if found is None:
        return f"| {words} | 0 | – | – | – | – | – |"
    (area, over), (auroc, fpr95) = found.allowed, found.reached
    return (
        f"| {words} | {found.unknowns} | {found.hidden:.2f} | {area:.3f} | {auroc:.3f} | {over:.2f} | "
        f"{fpr95:.2f} |"
    )


if __name__ == "__main__":
    main()
