"""Tables of a diagnosis beyond what is named: what each candidate would close, what these runs would name."""

from __future__ import annotations

from collections.abc import Sequence

from fogml.gap.result import Diagnosis
from fogml.gap.result_parts import CauseShare, Rehearsed, WhatIf
from fogml.numerals import MISSING, averages, number, percent, probability_words
from fogml.report.gap_words import interval_words, title_of
from fogml.report.style import regime_word
from fogml.report.tables import Table, columns_of

MOST_ROWS = 20
_SIZES = {"usual": "usual", "found": "as found"}
_WORST = ("mistaken", "missed", "named")
_FORMS = {"usual": "middle of the ranges", "low": "low ends", "high": "high ends"}


def nearest_table(found: Diagnosis, names: dict[str, str]) -> Table | None:
    """The known causes that hold most of the gap; None where there is no gap, or none is known."""
    if not found.nearest or found.verdict == "no_gap":
        return None
    rows = [
        (title_of(n.effect, names), percent(n.share), probability_words(n.probability)) for n in found.nearest
    ]
    return Table(
        "Known cause | >Of the fit runs' gap | >Probability",
        rows,
        caption=(
            "What each holds alone, in whatever form its family has: it is no name. Probability: as the fits "
            "weigh it; a name's is lower, as no form is quite known."
        ),
    )


def shares_table(found: Diagnosis, names: dict[str, str]) -> Table | None:
    """What share of the gap each cause makes: in all, on each run, in each regime; None without causes."""
    if not found.shares:
        return None
    causes = list(dict.fromkeys(s.effect for s in found.shares))
    groups: dict[tuple[str | None, str | None], dict[str, CauseShare]] = {}
    for share in found.shares:
        groups.setdefault((share.run, share.regime), {})[share.effect] = share
    rows = []
    for (run, regime), held in groups.items():
        where = run or (regime_word(regime) if regime else "in all")
        cells = [f"{percent(held[c].share)} ({interval_words(*held[c].ci90)})" for c in causes]
        rows.append((where, *cells))
    return Table(
        columns=(
            *columns_of("Run or regime"),
            *((_cause(c, names), "90 % interval", "figure") for c in causes),
        ),
        rows=rows,
        caption="Of what all causes of the likeliest set together take away of the gap's energy, named or "
        "not. Where causes cancel, one may have less than none.",
    )


def _cause(id: str, names: dict[str, str]) -> str:
    return "Something unknown" if id == "unknown" else title_of(id, names)


def what_if_table(found: Diagnosis, names: dict[str, str]) -> Table | None:
    """What the held-out runs keep with each candidate, the most closed first; None where not known."""
    if not found.what_if:
        return None
    ranked = sorted(found.what_if, key=lambda w: (len(w.beside), -w.share))
    rows = [_what_if(w, names) for w in ranked[:MOST_ROWS]]
    return Table(
        "Candidate | Beside | >Of the fit runs' gap | Run [held out] | >After [deg/h] | "
        ">Closed | 90 % interval",
        rows,
        caption="Each candidate in whatever form its family has, fitted alone or beside what is named. Those "
        f"that hold most of the gap, at most {MOST_ROWS}; gap.json has all.",
    )


def _what_if(w: WhatIf, names: dict[str, str]) -> tuple[str, ...]:
    return (
        title_of(w.effect, names),
        "; ".join(title_of(b, names) for b in w.beside) or MISSING,
        percent(w.share),
        w.run,
        number(w.after),
        percent(w.closed),
        MISSING if w.closed_ci90 is None else interval_words(*w.closed_ci90),
    )


def rehearsal_table(rehearsal: Sequence[Rehearsed], names: dict[str, str]) -> Table | None:
    """What runs would name if each candidate acted alone; None where it was not asked for."""
    if not rehearsal:
        return None
    return Table(
        "If this acted | Shape | Size | >Shows [noise lengths] | It would be | >Probability of the name",
        (_rehearsed(r, names) for r in sorted(rehearsal, key=lambda r: (_WORST.index(r.outcome), -r.length))),
        caption="Each candidate alone is put into replays of these runs, without noise; what is missed is "
        "called unknown, or no gap. Shows: its length beside the constants, in standard deviations of the "
        "noise; under 3 nothing can be told.",
    )


def _rehearsed(r: Rehearsed, names: dict[str, str]) -> tuple[str, ...]:
    titles = " or ".join(title_of(m, names) for m in r.named_as)
    outcome = {"missed": "missed", "mistaken": f"mistaken for {titles}", "named": f"named {titles}"}
    return (
        title_of(r.effect, names),
        _FORMS[r.form],
        _SIZES[r.size],
        number(r.length),
        outcome[r.outcome],
        MISSING if r.outcome == "missed" else probability_words(r.probability),
    )


def compensation_table(found: Diagnosis, names: dict[str, str]) -> Table | None:
    """What a drift model made of the diagnosis brings on each held-out run; None where none was fitted."""
    told = found.compensation
    if told is None or not told.held_out:
        return None
    causes = " and ".join(title_of(c.effect, names) for c in told.counted) or "no cause"
    return Table(
        "Run | >Before [deg/h] | >The twin's constants [deg/h] | >With the causes [deg/h] | "
        ">Noise floor [deg/h]",
        ((b.run, *(number(v) for v in (b.before, b.constants, b.after, b.floor))) for b in told.held_out),
        caption=f"Rms of {averages(told.held_out[0].averaging_s)}, compensated by what the unit itself knows "
        f"in service; causes: {causes}.",
    )
