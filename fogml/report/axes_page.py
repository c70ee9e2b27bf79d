"""Pages that lead to others: of files of three gyros, and of several units that were diagnosed together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from fogml.numerals import MISSING, averages, duration, number, percent, with_error
from fogml.report.acceptance_page import VERDICTS, limit_words
from fogml.report.page import render
from fogml.report.tables import Table, columns_of
from fogml.report.verdict import GRADES

PAGES = {
    "train": "report.html",
    "compare": "compare.html",
    "inspect": "inspect.html",
    "noise": "noise.html",
    "lab acceptance": "acceptance.html",
}
"""Page of each command in an axis' folder."""


def axes_page(values: Mapping[str, Any], links: Mapping[str, str]) -> str:
    """The self-contained HTML page of what a command told of each axis.

    Parameters
    ----------
    values
        Schema ``fogml.axes/1``: ``command``, and ``axes`` with what its ``--json`` prints of each.
    links
        Axis to the address of its page.
    """
    command, axes = values["command"], values["axes"]
    kicker, headings, row = _SHOWN[command]
    table = Table(f"Axis | {headings}", ((axis, *row(told)) for axis, told in axes.items()))
    return render(
        "axes.html",
        title=f"fogml {command} – axes {', '.join(axes)}",
        name=_name(axes),
        kicker=kicker,
        links=[(axis, links[axis], _mark(told)) for axis, told in axes.items()],
        table=table,
    )


def _name(axes: Mapping[str, Any]) -> str:
    """Unit and axes, as far as what was told names them."""
    first = next(iter(axes.values()))
    run = first
    if first.get("serial_number"):
        return f"{first['serial_number']}, axes {', '.join(axes)}"
    for key in ("test", "runs"):
        if first.get(key):
            run = first[key][0]
    if first.get("models"):
        run = next(iter(first["models"].values()))["test"][0]
    unit = run.get("serial_number")
    return f"{unit}, axes {', '.join(axes)}" if unit else f"{run.get('run', 'run')}, axes {', '.join(axes)}"


def _mark(told: Mapping[str, Any]) -> dict[str, str] | None:
    """The verdict on an axis' model, where there is one."""
    if "verdict" not in told:
        return None
    kind, sign, words = {**GRADES, **VERDICTS}[told["verdict"]]
    return {"kind": kind, "sign": sign, "words": words}


def _train(told: Mapping[str, Any]) -> tuple[str, ...]:
    run = max(told["test"], key=lambda one: one["after"]["rms"])
    figures = (run["before"]["rms"], run["after"]["rms"], run["after"]["bias_stability"], run["floor"])
    return (
        str(told["model"]["kind"]),
        *map(number, figures),
        averages(run["averaging_s"]),
        told["reasons"][0],
    )


def _compare(told: Mapping[str, Any]) -> tuple[str, ...]:
    worst = {
        name: max(body["test"], key=lambda run: run["after"]["rms"]) for name, body in told["models"].items()
    }
    best = min(worst, key=lambda name: float(worst[name]["after"]["rms"]))
    auto = worst.get("auto")
    return (
        number(worst[best]["before"]["rms"]),
        number(auto["after"]["rms"]) if auto else MISSING,
        best,
        number(worst[best]["after"]["rms"]),
        number(worst[best]["floor"]),
    )


def _inspect(told: Mapping[str, Any]) -> tuple[str, ...]:
    runs = told["runs"]
    gyro = [column for run in runs for column in run["columns"] if column["name"] == "gyro"]
    noticed = {finding["code"].replace("_", " ") for run in runs for finding in run["findings"]}
    return (
        str(sum(run["rows"] for run in runs)),
        duration(sum(run["span_s"] for run in runs)),
        "; ".join(number(one["mean"], 4) for one in gyro),
        "; ".join(number(one["standard_deviation"]) for one in gyro),
        ", ".join(sorted(noticed)) or "nothing",
    )


def _noise(told: Mapping[str, Any]) -> tuple[str, ...]:
    terms, minimum = told["terms"], told["minimum"]
    values = (terms[name].get("value") for name in ("Q", "N", "B", "K", "R"))
    return (*map(number, values), number(minimum["adev"]), number(minimum["tau_s"]))


def _acceptance(told: Mapping[str, Any]) -> tuple[str, ...]:
    tested = [row for row in told["rows"] if row["tested"]]
    missed = [f"{row['name']} ({limit_words(row)})" for row in tested if row["met"] is False]
    limited = [row for row in told["rows"] if row["limit"] is not None]
    return (
        f"{len(tested)} of {len(told['rows'])}",
        f"{sum(row['met'] is True for row in limited)} of {len(limited)}" if limited else MISSING,
        "; ".join(missed) or MISSING,
        "; ".join(told["reasons"]),
    )


_SHOWN: dict[str, tuple[str, str, Callable[[Mapping[str, Any]], tuple[str, ...]]]] = {
    "train": (
        "Drift models, one an axis, judged on other runs",
        "Model | >Rms before [deg/h] | >Rms after [deg/h] | >Bias stability after [deg/h] | "
        ">Noise floor [deg/h] | Of | Why",
        _train,
    ),
    "compare": (
        "Models compared, axis by axis",
        ">Rms before [deg/h] | >Rms, auto [deg/h] | Least on the test runs | >Its rms [deg/h] | "
        ">Noise floor [deg/h]",
        _compare,
    ),
    "inspect": (
        "What is in the runs, axis by axis",
        ">Rows | >Span | >Mean [deg/h or counts] | >Standard deviation [deg/h or counts] | Noticed",
        _inspect,
    ),
    "noise": (
        "Noise, axis by axis",
        ">Q [µrad] | >N [deg/√h] | >B [deg/h] | >K [deg/h/√h] | >R [deg/h/h] | "
        ">Least deviation [deg/h] | >at [s]",
        _noise,
    ),
    "lab acceptance": (
        "Acceptance reports, axis by axis",
        ">Tested | >Limits met | Missed | Why",
        _acceptance,
    ),
}
"""Of each command: what stands above the heading, and the table's columns and rows."""


def units_page(values: Mapping[str, Any], words: Mapping[str, str]) -> str:
    """The self-contained HTML page of a ``units.json`` (schema ``fogml.gap_units/1``).

    `words` are verdict and named causes of each unit.
    """
    units = list(values["units"])
    return render(
        "units.html",
        title=f"Units {', '.join(units)}",
        links=[(unit, f"{values['folders'][unit]}/gap.html", words[unit]) for unit in units],
        shared=_shared(values["shared"], units) if values["shared"] else None,
    )


def _shared(causes: Sequence[Mapping[str, Any]], units: Sequence[str]) -> Table:
    rows = []
    for cause in causes:
        sizes = (_size(cause["sizes"].get(unit)) for unit in units)
        ends = cause["next_unit"]
        following = f"{number(ends[0])} … {number(ends[1])}" if ends else MISSING
        rows.append(
            (
                cause["effect"],
                percent(cause["probability"]),
                cause["unit"],
                *sizes,
                _size(cause["mean"]),
                following,
            )
        )
    return Table(
        columns=(
            *columns_of("Cause | >Probability | Unit of size"),
            *((unit, "", "figure pair") for unit in units),
            *columns_of(">>Mean | >>Next unit [90 % interval]"),
        ),
        rows=rows,
        caption="Probability that it acts in units of this kind; sizes ± standard error.",
    )


def _size(told: Mapping[str, Any] | None) -> str:
    return MISSING if told is None else with_error(told["value"], told["se"])
