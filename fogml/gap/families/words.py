"""The result in sentences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fogml.gap.how_far_result import HowFar, Nearest
from fogml.gap.result import Found, Verdict
from fogml.gap.where_result import GapSegment
from fogml.twin.registry import effect

if TYPE_CHECKING:
    from fogml.gap.families.inference import Inference
    from fogml.gap.families.posterior import Judgement


def looks_like(found: Inference, judged: Judgement) -> str:
    """What the unknown looks like; empty where there is none."""
    families = found.columns.families
    weights: dict[str, float] = {}
    for e, w in zip(judged.explanations, judged.weights):
        for m in e.members:
            if families[m.family].kind == "unknown":
                weights[families[m.family].words] = weights.get(families[m.family].words, 0.0) + float(w)
    if judged.unknown < 0.05 or not weights:
        return ""
    return max(weights, key=weights.__getitem__)


def headline(
    found: Inference,
    judged: Judgement,
    verdict: Verdict,
    shown: Sequence[Found],
    nearest: Sequence[Nearest],
    far: Sequence[HowFar],
    segments: Sequence[GapSegment],
) -> tuple[str, ...]:
    """Sentences: the verdict, each cause with its size, share and place, the nearest where none is sure."""
    said = []
    if verdict == "no_gap":
        said.append("Nothing is missing that these runs could show.")
    for f in (f for f in shown if f.named):
        title = effect(f.effect).title
        others = f" (or {', '.join(f.others)})" if f.others else ""
        size = f"{f.amplitude.value:.3g} {f.amplitude.unit}"
        usual = f", {f.times_usual:.2g} times the usual most" if (f.times_usual or 0.0) > 1.0 else ""
        share = f", {f.share:.0%} of the gap" if f.share is not None else ""
        look = f"; look at the {f.place}" if f.place else ""
        said.append(f"{title}{others}: {f.probability:.0%} probable, {size}{usual}{share}{look}.")
        if f.onset is not None:
            said.append(
                f"{title} acts from {f.onset.run} on, {f.onset.time_s:.0f} s into it, and not before."
            )
        if f.grows is not None:
            way = "grows" if f.grows * f.amplitude.value > 0.0 else "fades"
            said.append(f"{title} {way} from run to run, by {abs(f.grows):.2g} {f.amplitude.unit} a day.")
        elif not f.consistent and len(f.by_run) > 1:
            said.append(f"{title}: the runs do not agree in its size.")
    if verdict in ("unknown", "partly_explained"):
        like = looks_like(found, judged)
        said.append(f"Something acts that is not known{': it ' + like if like else ''}.")
        for n in [n for n in nearest if n.effect not in {f.effect for f in shown if f.named}][:2]:
            if n.share >= 0.2:
                said.append(
                    f"Nearest known cause: {effect(n.effect).title.lower()}, in whatever form, holds "
                    f"{n.share:.0%} of the gap."
                )
    order = sorted(range(found.setting.scene.fitted), key=lambda i: found.setting.scene.begun_s[i])
    runs = [found.setting.scene.runs[i].run.name for i in order]
    first = min((runs.index(s.run) for s in segments), default=0)
    if first > 0:
        begun = min(s.from_s for s in segments if s.run == runs[first])
        said.append(
            f"The gap shows from {runs[first]}, {begun:.0f} s, on, and in no run before: a diagnosis of the "
            "runs from there on may name more."
        )
    for h in far:
        if h.closed is None:
            said.append(f"{h.run}: {h.note}.")
        elif any(f.named for f in shown):
            said.append(f"{h.run}: {h.closed:.0%} of the gap closes{' — ' + h.note if h.note else ''}.")
    return tuple(said)
