"""Tables of a diagnosis: causes, look-alikes, how far, segments, constants, noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

from fogml.gap.result import Diagnosis, Found
from fogml.numerals import MISSING, averages, duration, number, percent, unit_words, with_error
from fogml.report.gap_words import (
    STATUS_WORDS,
    closed_words,
    estimate_words,
    interval_words,
    probability_words,
    title_of,
)
from fogml.report.style import regime_word
from fogml.report.tables import Row, Table, columns_of
from fogml.twin.registry import effects

MOST_SEGMENTS = 12
_NOISE = {
    "N": ("angle random walk", "deg/√h"),
    "B": ("flicker", "deg/h"),
    "K": ("rate random walk", "deg/h/√h"),
}
CONSTANTS = {
    "e0": "scale factor",
    "k1": "scale factor, by T",
    "k2": "scale factor, by T²",
    "b0": "bias",
    "b1": "bias, by T",
    "b2": "bias, by T²",
    "g": "bias, by T_in − T_out",
    "m": "bias, by ΔT",
}
"""What the twin's constants are, by their names."""


def causes_table(found: Diagnosis, names: dict[str, str]) -> Table | None:
    """Every effect that was found, the most certain first, then what is suspected; None without any."""
    rows = []
    listed = [(f, False) for f in found.found] + [(f, True) for f in found.suspected]
    for f, is_suspected in listed:
        shape = "; ".join(
            f"{name.replace('_', ' ')} {estimate_words(value)}" for name, value in f.parameters.items()
        )
        others = [title_of(m, names) for m in f.others]
        others += [f"{title_of(m, names)}, which was left out" for m in f.left_out]
        cells = (
            f"{'Suspected: ' if is_suspected else ''}{title_of(f.effect, names)} ({f.effect})",
            probability_words(f.probability),
            with_error(f.amplitude.value, f.amplitude.se),
            unit_words(f.amplitude.unit) or MISSING,
            MISSING if f.times_usual is None else f"{number(f.times_usual, 2)} ×",
            percent(f.share),
            f.place or MISSING,
            shape or MISSING,
            "; ".join(others) or "nothing: alone in its class",
            _agreement(f) + ("" if f.onset is None else f"; from {f.onset.run}, {f.onset.time_s:.0f} s, on"),
        )
        rows.append(Row(cells, "chosen" if f.named and not is_suspected else ""))
    if not rows:
        return None
    return Table(
        "Effect | >Probability | >Amplitude [± standard error] | Unit | "
        ">Size [of the usual most] | >Of the gap [share] | Look at | Shape [± standard error] | "
        "Can't be told from | On the runs",
        rows,
        caption="Highlighted: named. The probability is that one of its class acts; amplitude and shape are "
        "of the effect that stands for the class. Suspected: likely, and not sure enough for a name.",
    )


def _agreement(found: Found) -> str:
    """How an effect's sizes on the runs go together."""
    count = len(found.by_run)
    if found.grows is not None:
        way = "grows" if found.grows * found.amplitude.value > 0.0 else "fades"
        return f"{way} by {number(abs(found.grows), 2)} {unit_words(found.amplitude.unit)} a day"
    if count > 1:
        # Of one that began, the runs since then are held against each other.
        counted = f" ({count} runs)" if found.onset is None else ""
        return f"{'agree in sign and size' if found.consistent else 'do not agree'}{counted}"
    return "one run alone can show it" if found.by_run else "no single run shows it"


def classes_table(found: Sequence[Found], names: dict[str, str]) -> Table | None:
    """For each pair that the runs can't tell apart, what separates them; None where all stand alone."""
    catalogue = effects()
    rows = []
    for f in found:
        for first, second in combinations(f.members, 2):
            told = []
            for a, b in ((first, second), (second, first)):
                if a in catalogue and b in catalogue[a].confused_with:
                    told.append(catalogue[a].confused_with[b])
            # The two cards often say the same of each other.
            separates = "; or: ".join(dict.fromkeys(told)) or "the cards name no simple test"
            rows.append((title_of(first, names), title_of(second, names), separates))
    if not rows:
        return None
    return Table("These | look alike here | What separates them", rows)


def how_far_table(found: Diagnosis) -> Table:
    """Rms on each held-out run and what is closed of the structural gap."""
    named = bool(found.named)
    columns = columns_of(
        "Held out | >Nominal [deg/h] | >Recalibrated [deg/h] | >With what was found [deg/h] | "
        ">Noise floor [deg/h] | >Closed | >90 % interval"
    )
    rows = []
    for item in found.how_far:
        cells = [
            item.run,
            *(number(v) for v in (item.before, item.recalibrated, item.after, item.floor)),
            closed_words(item),
            interval_words(*item.closed_ci90) if item.closed_ci90 else MISSING,
        ]
        rows.append(tuple(cells if named else cells[:3] + cells[4:5]))
    return Table(
        columns=columns if named else columns[:3] + columns[4:5],
        rows=rows,
        caption=f"Rms of {averages(found.how_far[0].averaging_s)} of recorded less replayed."
        + (
            " Closed: the part of recalibrated² − floor² that goes; above 100 % or below 0 is chance "
            "or a misfit."
            if named
            else " Nothing was added, so nothing is closed beyond recalibrating."
        ),
    )


def segments_table(found: Diagnosis) -> Table | None:
    """The segments with the largest excess, in order of time."""
    segments = sorted(found.where.segments, key=lambda s: -s.excess_rms * (s.to_s - s.from_s) ** 0.5)
    if not segments:
        return None
    kept = sorted(segments[:MOST_SEGMENTS], key=lambda s: (s.run, s.from_s))
    more = len(segments) - len(kept)
    return Table(
        "Run | >From [s] | >To [s] | >Lasts | >Excess rms [deg/h]",
        (
            (
                s.run,
                f"{max(s.from_s, 0.0):.0f}",
                f"{s.to_s:.0f}",
                duration(s.to_s - s.from_s),
                number(s.excess_rms),
            )
            for s in kept
        ),
        caption="Segments in which the gap exceeds the floor"
        + (f"; {more} smaller ones are in gap.json." if more else "."),
    )


def regimes_table(found: Diagnosis) -> Table:
    """Excess and share in each regime, with their intervals."""
    rows = []
    for s in found.where.regime:
        low, high = s.excess_rms_ci90 or (None, None)
        part = interval_words(*s.share_ci90) if s.share_ci90 else MISSING
        rows.append(
            (
                regime_word(s.name),
                number(s.excess_rms),
                f"{number(low)} … {number(high)}",
                percent(s.share),
                part,
            )
        )
    return Table("Regime | >Excess rms [deg/h] | >90 % interval [deg/h] | >Share | >90 % interval", rows)


def alternatives_table(alternatives: Sequence[Mapping[str, Any]]) -> Table:
    """Other programmes that were weighed as the next run."""
    return Table(
        "Programme | >Lasts | >Expected distance",
        (
            (
                str(other.get("summary") or other.get("programme") or MISSING),
                duration(3600.0 * other["hours"]) if "hours" in other else MISSING,
                number(other.get("distance"), 2),
            )
            for other in alternatives
        ),
    )


def constants_table(found: Diagnosis) -> Table:
    """Prior and fitted value of each constant."""
    rows = [
        (
            f"{c.name}: {CONSTANTS[c.name]}" if c.name in CONSTANTS else c.name,
            f"{number(c.prior_mean)} ± {number(c.prior_sd, 2)}",
            with_error(c.value, c.se),
            unit_words(c.unit),
            percent(1.0 - min(c.se / c.prior_sd, 1.0)) if c.prior_sd > 0.0 else MISSING,
        )
        for c in found.constants
    ]
    return Table(
        "Constant | >Prior [± sd] | >Fitted [± se] | Unit | >Learnt",
        rows,
        caption="Learnt: by how much the runs narrowed the prior.",
    )


def noise_table(found: Diagnosis) -> Table:
    """Coefficients of the noise with their standard errors."""
    rows = []
    for name, value in found.noise.coefficients.items():
        words, unit = _NOISE.get(name, (name, ""))
        spread = found.noise.relative_se.get(name)
        rows.append((f"{name}, {words}", number(value), MISSING if spread is None else percent(spread), unit))
    return Table("Coefficient | >Value | >Standard error | Unit", rows)


def evidence_table(found: Diagnosis) -> Table:
    """Every candidate, the largest gain first."""
    return Table(
        "Candidate | Stage | >Gain alone [nats] | >Probability | >Length at usual size | Outcome",
        (
            Row(
                (
                    f"{e.title} ({e.effect})",
                    e.stage.replace("_", " "),
                    MISSING if e.status == "in_constants" else number(e.gain),
                    MISSING
                    if e.status in ("in_constants", "undetectable") and e.probability == 0.0
                    else probability_words(e.probability),
                    MISSING if e.status == "in_constants" else number(e.usual_length),
                    STATUS_WORDS[e.status],
                ),
                "chosen" if e.status == "named" else "",
            )
            for e in found.evidence
        ),
    )
