"""What came out of the shipped recordings before and now, and why it moved."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from experiments.real_files.section import Section, table
from fogml.models.names import make_model
from fogml.runs.noise_of_run import noise_report
from fogml.runs.shipped import shipped_names, shipped_run
from fogml.validation.judge import judge

BEFORE = Path(__file__).with_name("recordings_before.json")
"""N of each run by a fit to the Allan deviation, floors of white noise alone, and standard errors for white
residuals."""
MOVED = 0.05
"""Share from which a figure counts as moved."""
SPLITS = {"thermal-cycle-1": "thermal-cycle-2", "cold-start": "cold-start"}
"""Recording trained on to the one judged on; the cold start is one run, and its floor is all that is told."""


def noise_of(name: str) -> dict[str, Any]:
    """N with its interval, and what the report says of the spectrum."""
    told = noise_report(shipped_run(name))
    reasons = []
    form = told["filter"]
    if form is not None and form["kind"] == "other":
        reasons.append(
            f"above {form['above_hz']:.3g} Hz the spectrum is not the gyro's noise, and is left out"
        )
    elif form is not None:
        reasons.append(f"{form['words']} at {form['corner_hz']:.3g} Hz, N is that ahead of it")
    if told["correlated"] is not None:
        deviation, time_s = told["correlated"]["deviation"], told["correlated"]["correlation_s"]
        reasons.append(f"correlated noise of {deviation:.3g} deg/h over {time_s:.2g} s was taken for N")
    if told["fit_p_value"] < 1e-3:
        reasons.append("no model fits, which is said")
    if not reasons:
        reasons.append(
            "likelihood of the whole spectrum; quantisation and flicker are told apart by evidence"
        )
    return {"N": told["terms"]["N"], "why": "; ".join(reasons)}


def judged(train: str, test: str) -> dict[str, Any]:
    """Floor of the run judged on with its interval, and the standard error of the coefficient of T."""
    trained, other = shipped_run(train), shipped_run(test)
    model = make_model("polynomial").fit(trained)
    run = judge(model, trained, other).test[0]
    error = model.describe()["coefficients"]["T"]["se"]
    return {"floor": run.floor, "ci90": run.floor_ci90, "se_T": error, "averaging_s": run.averaging_s}


def section(quick: bool) -> Section:
    """Noise terms, floors and standard errors, before and now."""
    before = json.loads(BEFORE.read_text("utf-8"))
    names = shipped_names()[:2] if quick else shipped_names()
    noise = {name: noise_of(name) for name in names}
    splits = {f"{a}-{axis}": f"{b}-{axis}" for a, b in SPLITS.items() for axis in ("x" if quick else "xyz")}
    floors = {train: judged(train, test) for train, test in splits.items()}
    rows = []
    for name, found in noise.items():
        was, now = before["noise"][name], found["N"]["value"]
        if was is not None and now is not None and abs(now / was - 1.0) <= MOVED:
            continue
        low, high = found["N"]["ci"]
        rows.append((name, _figure(was), f"{_figure(now)} ({low:.3g} to {high:.3g})", found["why"]))
    kept = len(noise) - len(rows)
    text = (
        "## Shipped recordings: what moved, and why\n\n"
        "**Real recordings**: MEMS (`thermal-cycle`, `cold-start`, `two-temperatures`) and a ring laser "
        f"(`ring-laser`); none of a fibre-optic gyro. N [deg/√h] of {len(noise)} runs; {kept} moved by "
        f"{MOVED:.0%} at most and are not listed.\n\n"
    )
    text += table(("run", "N before", "N now (90 %)", "why"), rows)
    text += (
        "\n\nFloors of 100 s averages [deg/h] and standard errors of the coefficient of T [deg/h/degC], of "
        "the default polynomial. The floor before was the white noise of the run with part of its drift; now "
        "it is the noise model's, with what the temperature drives kept out. The standard errors before took "
        "residuals for white; what these models leave is slow by far.\n\n"
    )
    lines = []
    for name, now in floors.items():
        was, (low, high) = before["judged"][name], now["ci90"]
        lines.append(
            (
                f"{name} → {splits[name]}",
                _figure(was["floor"]),
                f"{_figure(now['floor'])} ({low:.2g} to {high:.2g})",
                _figure(was["se_T"]),
                _figure(now["se_T"]),
            )
        )
    header = ("split", "floor before", "floor now (90 %)", "se of T before", "se of T now")
    return Section(text + table(header, lines) + "\n", {"noise": noise, "judged": floors})


def _figure(value: float | None) -> str:
    return "none" if value is None else f"{value:.3g}"
