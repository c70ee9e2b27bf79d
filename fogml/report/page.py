"""One self-contained page: text, figures as data, style, and plotly.js inlined once."""

from __future__ import annotations

import base64
import gzip
import json
import re
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

import fogml
from fogml import numerals
from fogml.escaping import figure_text, markup, script_data

if TYPE_CHECKING:
    import plotly.graph_objects as go


@dataclass(frozen=True)
class Drawing:
    """A figure with what a reader who cannot see it needs.

    Attributes
    ----------
    figure
        The figure, styled, with its height in its layout.
    alt
        What it shows, in a sentence or two.
    caption
        What to look for; below the figure.
    half
        Whether it stands beside something else on a wide screen.
    """

    figure: go.Figure
    alt: str
    caption: str = ""
    half: bool = False


@dataclass(frozen=True)
class Tile:
    """A headline figure: its name, value, unit, a note below, and ``met`` or ``missed`` if it is one."""

    name: str
    value: str
    unit: str = ""
    note: str = ""
    kind: str = ""


class _Drawings:
    """Gives each figure of a page its number, and remembers whether plotly.js is needed."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, drawing: Drawing) -> Markup:
        self.count += 1
        data = script_data(json.dumps(_as_shown(json.loads(drawing.figure.to_json())), ensure_ascii=False))
        template = _environment().get_template("figure.html")
        height = drawing.figure.layout.height or 400
        return Markup(template.render(drawing=drawing, number=self.count, data=data, height=height))


FINEST_PIXEL = 1e-4
"""What of an axis's span no screen shows, zoomed in tenfold; samples are that exact at least."""

_MARKS = ("<br>", "<extra>", "</extra>")
_MARK = re.compile("(" + "|".join(_MARKS) + ")")


def _as_shown(value: Any) -> Any:
    """What a figure holds, its texts as plotly shows them letter by letter, but for the pages' own marks."""
    if isinstance(value, str):
        return "".join(part if part in _MARKS else figure_text(part) for part in _MARK.split(value))
    if isinstance(value, list):
        return [_as_shown(item) for item in value]
    if isinstance(value, dict):
        if "bdata" in value:
            return _halved(value)
        return {key: _as_shown(item) for key, item in value.items()}
    return value


def _halved(packed: dict[str, Any]) -> dict[str, Any]:
    """Samples that plotly packed as base64, in single precision where no pixel shows the difference."""
    if packed["dtype"] != "f8":
        return packed
    values = np.frombuffer(base64.b64decode(packed["bdata"]))
    finite = values[np.isfinite(values)]
    single = np.finfo(np.float32)
    most = min(FINEST_PIXEL / single.eps * np.ptp(finite), single.max) if finite.size else 0.0
    if finite.size == 0 or np.abs(finite).max() > most:
        return packed
    return packed | {"dtype": "f4", "bdata": base64.b64encode(values.astype(np.float32).tobytes()).decode()}


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("fogml.report", "templates"),
        autoescape=True,
        finalize=markup,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = numerals.number
    environment.filters["against"] = numerals.against
    environment.filters["stated"] = numerals.stated
    environment.filters["percent"] = numerals.percent
    environment.filters["probability"] = numerals.probability_words
    environment.filters["plural"] = numerals.plural
    environment.filters["breakable"] = _breakable
    environment.globals["label"] = numerals.label
    return environment


_LONG = re.compile(r"[^\s_&;]{17,}")
"""What may be no word of a language: the longest of a page's own has 16 letters."""
_INTERVAL = re.compile(r"\([^()]*…[^()]*\)(?:; \d+)?")


def _breakable(cell: object) -> Markup:
    """A cell's text: a long name breaks after marks or every 12 letters, an interval nowhere."""

    def steps(long: re.Match[str]) -> str:
        return re.sub(r"([./:\\-]|\w{12})(?=\w)", r"\1<wbr>", long[0])

    told = _INTERVAL.sub(lambda found: found[0].replace(" ", "\u00a0"), str(markup(cell)))
    parts = re.split(r"(<[^>]*>)", told.replace("_", "_<wbr>"))
    return Markup("".join(part if part.startswith("<") else _LONG.sub(steps, part) for part in parts))


def template_text(name: str) -> Markup:
    """A style sheet or script of the templates folder, as it stands."""
    loader = _environment().loader
    assert loader is not None
    return Markup(loader.get_source(_environment(), name)[0])


@cache
def _plotly() -> Markup:
    # plotly.js's bundle of flat charts is a third of the one that plotly for Python ships.
    bundle = resources.files("fogml.report") / "templates" / "plotly" / "plotly-cartesian.min.js.gz"
    return Markup(gzip.decompress(bundle.read_bytes()).decode())


def render(template: str, *, title: str, **context: Any) -> str:
    """A whole HTML page from a template that extends ``base.html``.

    The template draws a figure with ``{{ draw(drawing) }}``. Everything is inlined, and a
    content security policy forbids the page any request.

    Parameters
    ----------
    template
        File name in ``fogml/report/templates``.
    title
        Title of the document.
    context
        What the template shows.
    """
    return (
        _environment()
        .get_template(template)
        .render(
            title=title,
            draw=_Drawings(),
            style=template_text("style.css"),
            script=template_text("figures.js"),
            plotly=_plotly,
            version=fogml.__version__,
            **context,
        )
    )
