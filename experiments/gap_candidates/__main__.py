"""Every candidate effect alone at d' = 25: is it named, how much is closed, and what if it is left out?

Run ``python -m experiments.gap_candidates``; it writes ``results.json`` and ``results.md`` beside itself.
With ids as arguments only these are diagnosed, and nothing is written.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from experiments.gap_candidates.cases import CONFIG, Bench, Case, plain_values
from experiments.results import write_results
from fogml import __version__
from fogml.gap import diagnose
from fogml.gap.result import Diagnosis
from fogml.twin.effect import NoiseEffect
from fogml.twin.registry import effect

HERE = Path(__file__).parent
LEAST_CLOSED = 0.95
SEEN = 0.5
"""Where the truth itself closes less than this share, the held-out run does not show the effect."""
DOUBT = 0.2
"""Probability of the unknown from which it shows doubt: with nothing missing it stays below."""


def judged(bench: Bench, case: Case) -> dict[str, Any]:
    """One effect as a candidate."""
    id = case.id
    shown = case.share >= CONFIG["least_share"]
    found = diagnose(bench.nominal, case.fit, [case.held_out], noise=bench.static, plan=False)
    row: dict[str, Any] = {
        "effect": id,
        "stage": effect(id).stage,
        "shown": shown,
        "amplitude": case.amplitude,
        "unit": effect(id).amplitude.unit,
        "d_prime": case.d_prime,
        "share": case.share,
        "verdict": found.verdict,
        "named": [f.effect for f in found.named],
        "class": [m for f in found.named if id in f.members for m in f.members],
        "probability": max((f.probability for f in found.named if id in f.members), default=0.0),
        "unknown": found.unknown.probability,
        "undetectable": id in found.undetectable,
        "assumed": [words for words in found.assumed if words.startswith(f"{id} ")],
    }
    row |= _closed(bench, case, found)
    row["ok"] = _right(row) if shown else row["undetectable"] and not row["named"]
    return plain_values(row)


def _closed(bench: Bench, case: Case, found: Diagnosis) -> dict[str, Any]:
    (far,) = found.how_far
    values: dict[str, Any] = {"recalibrated": far.recalibrated, "after": far.after, "floor": far.floor}
    values |= {"closed": far.closed, "true_closed": None}
    if far.closed is not None:
        values["true_closed"] = bench.closed_by_truth(case, far.recalibrated, far.floor)
    return values


def _right(row: dict[str, Any]) -> bool:
    """Named in a class, nothing else named, and as much closed as the true form closes."""
    alone = len(row["named"]) == 1 and row["effect"] in row["class"]
    if not _seen(row):
        return alone
    return alone and row["closed"] >= LEAST_CLOSED * row["true_closed"]


def _seen(row: dict[str, Any]) -> bool:
    """Whether the held-out run shows the effect, so that what is closed can be judged."""
    return row["closed"] is not None and row["true_closed"] >= SEEN


def left_out(bench: Bench, case: Case) -> dict[str, Any]:
    """What is named in its stead, and whether that is a relative and the doubt shows."""
    found = diagnose(
        bench.nominal, case.fit, [case.held_out], noise=bench.static, without=[case.id], plan=False
    )
    named = {f.effect: round(bench.likeness(case, f), 3) for f in found.named}
    certain = [f for f in found.named if len(f.members) == 1 and found.unknown.probability < DOUBT]
    strange = [id for id, cosine in named.items() if cosine <= CONFIG["alike"]]
    return {
        "without": case.id,
        "verdict": found.verdict,
        "named": named,
        "classes": {f.effect: list(f.members) for f in found.named},
        "unknown": round(found.unknown.probability, 4),
        "ok": not strange and not certain,
    }


def page(rows: list[dict[str, Any]]) -> str:
    """The result page."""
    shown = [r for r in rows if r["shown"]]
    hidden = [r for r in rows if not r["shown"]]
    named = [r for r in shown if r["effect"] in r["class"]]
    clean = [r for r in named if len(r["named"]) == 1]
    judged_closed = [r for r in clean if _seen(r)]
    enough = [r for r in judged_closed if r["closed"] >= LEAST_CLOSED * r["true_closed"]]
    kept = [r for r in shown if r["without"]["ok"]]
    silent = [r for r in shown if not r["without"]["named"]]
    lines = [
        "| effect | d′ | share | verdict | named | class | p | unknown | closed | truth closes | right | "
        "left out: verdict | named (cosine) | unknown | right |",
        "|---|---:|---:|---|---|---|---:|---:|---:|---:|---|---|---|---:|---|",
    ]
    lines += [_line(r) for r in sorted(shown, key=lambda r: (r["stage"], r["effect"]))]
    listed = "\n".join(
        f"- `{r['effect']}`: share {r['share']:.4f}, "
        + ("in `undetectable`" if r["undetectable"] else "**not in `undetectable`**")
        + (f", **named: {', '.join(r['named'])}**" if r["named"] else "")
        for r in hidden
    )
    said = "\n".join(f"- {words}" for r in shown for words in r["assumed"])
    return f"""# Every candidate effect alone at d′ = {CONFIG["d_prime"]:g}

Data: **synthetic**, the twin's own effects (for a reality that is not the twin see `experiments/gap_blind`):
one unit with constants drawn from their priors, programmes `{CONFIG["fit"][0]}` and `{CONFIG["fit"][1]}`
to fit, `{CONFIG["held_out"]}` held out, {CONFIG["sample_s"]:g} s a sample, a static run of
{CONFIG["static_h"]} h for the noise. d′ is the whitened length of what the effect truly adds to recorded less
replayed, beside the nominal constants, over both fit runs; *share* is the part of its length that is left
beside them. Seed {CONFIG["seed"]}; fogml {__version__}; `python -m experiments.gap_candidates`, settings in
`config.yaml`.

| asked | of | reached |
|---|---:|---:|
| named, alone or within its class | {len(shown)} | {len(named)} |
| and nothing else named | {len(shown)} | {len(clean)} |
| and `closed` at least {LEAST_CLOSED:g} of what the true form closes | {len(judged_closed)} | {len(enough)} |
| does not show beside the constants: stands in `undetectable`, nothing named | {len(hidden)} | {
        sum(r["ok"] for r in hidden)
    } |
| left out of the candidates: nothing named but a relative, and the doubt shows | {len(shown)} | {len(kept)} |
| left out of the candidates: nothing named at all | {len(shown)} | {len(silent)} |

`closed` is not told where the recalibrated twin is at the floor within its noise, and not judged where the
truth itself closes less than half of the gap: there the held-out run does not show the effect. A relative has
a cosine above {CONFIG["alike"]:g} with what the effect truly adds, a line at its best phase on every run.
The doubt shows in a class of several or in an unknown of {DOUBT:g} or more. Where what is named looks like
an effect that was left out (cosine over 0.95 of the signatures, whatever the data), the diagnosis says so and
counts the other as unknown: that takes the left-out effect's signature. In `experiments/gap_blind` the
catalogue does not hold what is left out, and no such doubt is raised.

## Effects that show

{chr(10).join(lines)}

What the diagnoses say they assumed of these:

{said or "nothing"}

## Effects that do not show beside the constants

{listed or "none"}
"""


def _line(r: dict[str, Any]) -> str:
    number = lambda v: "–" if v is None else f"{v:.2f}"  # noqa: E731
    without = r["without"]
    instead = "; ".join(f"{id} ({cosine:.2f})" for id, cosine in without["named"].items()) or "–"
    others = [n for n in r["named"] if n not in r["class"]]
    named = ", ".join(r["named"]) or "–"
    return (
        f"| {r['effect']} | {r['d_prime']:.1f} | {r['share']:.2f} | {r['verdict'].replace('_', ' ')} "
        f"| {named}{' (!)' if others else ''} | {', '.join(r['class']) or '–'} | {r['probability']:.2f} "
        f"| {r['unknown']:.2f} | {number(r['closed'])} | {number(r['true_closed'])} | {_mark(r['ok'])} "
        f"| {without['verdict'].replace('_', ' ')} | {instead} | {without['unknown']:.2f} "
        f"| {_mark(without['ok'])} |"
    )


def _mark(right: bool) -> str:
    return "yes" if right else "**no**"


def _said(row: dict[str, Any]) -> dict[str, Any]:
    print(json.dumps(row), flush=True)
    return row


def main(wanted: list[str]) -> None:
    """Diagnose, print, and write where all were asked for."""
    bench = Bench()
    ids = wanted or [id for id in bench.model.candidates() if not isinstance(effect(id), NoiseEffect)]
    cases = {id: bench.case(id) for id in ids}
    rows = [_said(judged(bench, case)) for case in cases.values()]
    for row in rows:
        if row["shown"]:
            row["without"] = _said(left_out(bench, cases[row["effect"]]))
    if not wanted:
        write_results(HERE, rows, page(rows))


if __name__ == "__main__":
    main(sys.argv[1:])
