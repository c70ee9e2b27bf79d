"""Every kind of page from synthetic material, and a reader of HTML for the tests."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from typing import Any

import numpy as np

from fogml.report import (
    certificate,
    compare_page,
    gap_page,
    index_page,
    inspect_page,
    noise_page,
    train_page,
)
from fogml.report.gap_page import counterfactual_page
from fogml.runs.facts import Facts
from fogml.runs.findings import Finding
from fogml.runs.run import Run
from tests.report.diagnoses import diagnosis, with_courses
from tests.report.judgements import judgement

VOID = {"meta", "link", "br", "wbr", "img", "hr", "input", "path", "rect"}


def noise_values(*, moving: bool = False) -> dict[str, Any]:
    """A ``noise.json`` of white noise, flicker and rate random walk in closed form."""
    taus = np.geomspace(1.0, 1e4, 30)
    hours = taus / 3600.0
    adev = np.sqrt(0.01**2 / hours + (0.664 * 0.02) ** 2 + 0.03**2 * hours / 3.0)
    lowest = int(np.argmin(adev))
    terms = {
        "Q": {"value": None, "ci": [0.0, 0.5], "unit": "urad"},
        "N": {"value": 0.01, "ci": [0.0098, 0.0102], "unit": "deg/sqrt(h)"},
        "B": {"value": 0.02, "ci": [0.015, 0.025], "unit": "deg/h"},
        "K": {"value": 0.03, "ci": [0.02, 0.04], "unit": "deg/h/sqrt(h)"},
        "R": {"value": None, "ci": [0.0, 0.01], "unit": "deg/h/h"},
    }
    warnings = []
    if moving:
        reason = "not read from a run with moving temperature"
        terms["K"] = {"value": None, "ci": [None, None], "unit": "deg/h/sqrt(h)", "reason": reason}
        warnings = [{"code": "moving_temperature", "message": "The temperature moves by 4 degC."}]
    return {
        "schema": "fogml.noise/1",
        "run": "static.csv",
        "unit": "deg/h",
        "overlapping": True,
        "level": 0.9,
        "taus_s": taus.tolist(),
        "adev": adev.tolist(),
        "ci": np.column_stack((0.9 * adev, 1.1 * adev)).tolist(),
        "terms": terms,
        "minimum": {"adev": float(adev[lowest]), "tau_s": float(taus[lowest])},
        "warnings": warnings,
        "notes": [w["message"] for w in warnings],
        "findings": [],
    }


def recorded_run(n: int = 20_000) -> Run:
    """A run with two sensors, a ramp, a turn of the table and a gap."""
    random = np.random.default_rng(3)
    time = np.arange(n) * 1.0
    time[n // 2 :] += 600.0
    temperature = np.clip((time - 4000.0) / 200.0, 0.0, 40.0)
    return Run.from_columns(
        "a.csv",
        Facts(unit="FOG-0417", axis="x", latitude=39.9, input_axis="up"),
        time=time,
        gyro=9.6 + 0.01 * temperature + 0.2 * random.standard_normal(n),
        T_in=temperature,
        T_out=temperature + 0.3,
        rate=np.where((time > 2000.0) & (time < 2500.0), 5.0, 0.0),
    ).with_findings([Finding("outliers", "12 outliers over 8 robust sigma", "gyro", 1234, 12)])


def every_page() -> dict[str, str]:
    """Name to HTML of each kind of page."""
    models = {
        name: judgement(2, left=left, kind=name)
        for name, left in (("auto", 0.012), ("rbf", 0.01), ("mean", 1.0), ("multipoint-5-3", 2.0))
    }
    return {
        "train": train_page(judgement(gap=True, outside=0.1)),
        "train of five": train_page(judgement(5, left=0.1, offset=0.03)),
        "compare": compare_page(models, {"joint": "needs rate runs"}),
        "inspect": inspect_page([recorded_run(), recorded_run(3000)]),
        "noise": noise_page(noise_values()),
        "gap": gap_page(diagnosis()),
        "what if": counterfactual_page(with_courses(diagnosis())),
        "index": index_page({axis: judgement() for axis in "xyz"}),
        "certificate": certificate(judgement(5), "2026-03-02"),
    }


class Page(HTMLParser):
    """Elements, texts and figures of a page; complains where tags do not match."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.figures: list[dict[str, Any]] = []
        self.inline_scripts: list[str] = []
        self._open: list[tuple[str, dict[str, str | None]]] = []
        self.feed(html)
        self.close()
        assert not self._open, f"left open: {self._open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append((tag, dict(attrs)))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        opened, _ = self._open.pop()
        assert opened == tag, f"</{tag}> closes <{opened}>"

    def handle_data(self, data: str) -> None:
        if not self._open:
            return
        tag, attributes = self._open[-1]
        if tag == "script":
            if attributes.get("type") == "application/json":
                self.figures.append(json.loads(data))
            else:
                self.inline_scripts.append(data)
        elif tag != "style" and data.strip():
            self.texts.append(data.strip())

    @property
    def text(self) -> str:
        """All that is read on the page."""
        return " ".join(" ".join(self.texts).split())

    def of(self, tag: str) -> list[dict[str, str | None]]:
        """Attributes of every element of a kind."""
        return [attributes for name, attributes in self.elements if name == tag]
