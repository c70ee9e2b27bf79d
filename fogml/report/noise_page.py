"""The page of ``fogml noise``: Allan deviation and noise terms of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fogml.numerals import MISSING, duration, lowest_from, number, percent, unit_words
from fogml.report.figures_noise import TERM_WORDS, allan_plot
from fogml.report.page import Tile, render
from fogml.report.tables import Table, noticed


def noise_page(noise: Mapping[str, Any]) -> str:
    """The self-contained HTML page of a ``noise.json``.

    Parameters
    ----------
    noise
        Schema ``fogml.noise/1``. Beside its keys these are shown where they are there: ``run``,
        ``span_s``, ``sample_s``, ``overlapping``, ``level``, ``stretches``, ``warnings``, ``notes``,
        ``findings``, ``floor``, ``serial_number`` and ``axis``, and per term ``reason``.
    """
    name = str(noise.get("run", "run"))
    warned = {warning["message"] for warning in noise.get("warnings", ())}
    return render(
        "noise.html",
        title=f"{name} – noise",
        name=name,
        noise=noise,
        verdict=_verdict(noise),
        tiles=headline_tiles(noise),
        allan=allan_plot(noise),
        terms=terms_table(noise),
        table=deviations_table(noise),
        findings=noticed(noise.get("findings", ())),
        warnings=[warning["message"] for warning in noise.get("warnings", ())],
        notes=[note for note in noise.get("notes", ()) if note not in warned],
        about=_about(noise),
        replicates=replicates_table(noise),
    )


def _verdict(noise: Mapping[str, Any]) -> str:
    parts = []
    white = noise["terms"].get("N", {})
    if white.get("value") and (white.get("ci") or [1.0])[0]:
        parts.append(f"an angle random walk of {number(white['value'])} {_unit(white)}")
    minimum = noise.get("minimum") or {}
    if minimum.get("adev"):
        parts.append(
            f"a lowest Allan deviation of {number(minimum['adev'])} deg/h at {number(minimum['tau_s'])} s"
            + lowest_from(noise)
        )
    if not parts:
        return "The data support no noise term."
    return f"{noise.get('run', 'The run')} shows {' and '.join(parts)}."


def headline_tiles(noise: Mapping[str, Any]) -> list[Tile]:
    """Terms that the data show, floor and minimum."""
    tiles = []
    for key in ("N", "B", "K"):
        term = noise["terms"].get(key) or {}
        if term.get("value") and (term.get("ci") or [1.0])[0]:
            tiles.append(
                Tile(TERM_WORDS[key].capitalize(), number(term["value"]), _unit(term), _interval(term))
            )
    floor = noise.get("floor")
    if floor:
        low, high = floor["ci"][0]
        told = f"{number(low)} … {number(high)}, averages over {number(floor['averaging_s'][0])} s"
        if floor.get("source"):
            told += f", from {floor['source']}"
        tiles.append(Tile("Noise floor", number(floor["value"][0]), "deg/h", told))
    minimum = noise.get("minimum") or {}
    if minimum.get("adev"):
        tiles.append(
            Tile(
                "Minimum",
                number(minimum["adev"]),
                "deg/h",
                f"at {number(minimum['tau_s'])} s{lowest_from(noise)}",
            )
        )
    return tiles


def terms_table(noise: Mapping[str, Any]) -> Table:
    """Every noise term with its interval, and whether the data show it."""
    rows = []
    for key, words in TERM_WORDS.items():
        term = noise["terms"].get(key) or {}
        value, interval = term.get("value"), term.get("ci") or [None, None]
        if value is None:
            bound = "not seen" if interval[1] is None else f"no more than {number(interval[1])}"
            told = str(term.get("reason") or bound)
        else:
            told = "seen" if interval[0] else "not told from zero"
        rows.append((f"{key}, {words}", number(value), _interval(term), _unit(term), told))
    level = percent(float(noise.get("level", 0.9)), 0)
    return Table(f"Term | >Value | >{level} interval | Unit | In the data", rows)


def deviations_table(noise: Mapping[str, Any]) -> Table:
    """Allan deviations with their intervals."""
    intervals = noise.get("ci") or [[None, None]] * len(noise["taus_s"])
    return Table(
        ">τ [s] | >Allan deviation [deg/h] | >Interval [deg/h]",
        (
            (number(tau, 4), number(value), f"{number(low)} … {number(high)}")
            for tau, value, (low, high) in zip(noise["taus_s"], noise["adev"], intervals, strict=True)
        ),
    )


def _about(noise: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows = [
        ("estimator", "overlapping" if noise.get("overlapping", True) else "not overlapping"),
    ]
    for key, words in (("serial_number", "unit"), ("axis", "axis")):
        if noise.get(key):
            rows.append((words, str(noise[key])))
    for key, words in (("span_s", "span"), ("sample_s", "sample interval")):
        if noise.get(key):
            rows.append((words, duration(float(noise[key]))))
    if int(noise.get("stretches") or 1) > 1:
        rows.append(("stretches", str(noise["stretches"])))
    gaps = noise.get("gaps") or {}
    if gaps.get("count"):
        rows.append(("gaps", f"{gaps['count']}, {duration(float(gaps['lost_s']))} lost"))
    told = noise.get("filter")
    if told:
        corner = f" at {number(told['corner_hz'])} Hz" if told.get("corner_hz") else ""
        rows.append(("output filter", f"{told['words']}{corner}"))
    if noise.get("hold"):
        rows.append(("new values every", duration(float(noise["hold"]["interval_s"]))))
    if noise.get("correlated"):
        found = noise["correlated"]
        text = f"{number(found['deviation'])} deg/h, {duration(float(found['correlation_s']))}"
        rows.append(("correlated noise (Gauss-Markov)", text))
    for line in noise.get("sinusoids", ()):
        rows.append(("sinusoid", f"{number(line['amplitude'])} deg/h at {number(line['frequency_hz'])} Hz"))
    if "fit_p_value" in noise:
        rows.append(("chance of a worse fit", number(noise["fit_p_value"], 2)))
    return rows


def replicates_table(noise: Mapping[str, Any]) -> Table | None:
    """N of each run alone, where several share their terms."""
    runs = noise.get("runs") or ()
    if len(runs) < 2:
        return None
    terms = [(str(one["run"]), one["terms"]["N"]) for one in runs]
    return Table(
        f"Run | >N alone [{_unit(terms[0][1])}] | >Interval",
        ((name, number(term["value"]), _interval(term)) for name, term in terms),
    )


def _unit(term: Mapping[str, Any]) -> str:
    return unit_words(str(term.get("unit", "")))


def _interval(term: Mapping[str, Any]) -> str:
    interval = term.get("ci")
    if not interval or interval[0] is None:
        return MISSING
    return f"{number(interval[0])} … {number(interval[1])}"
