"""A result at a glance: for a notebook a heading with pictures, and the same as a plotly figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from markupsafe import Markup

from fogml.escaping import figure_text, markup
from fogml.signals.drawn import drawn
from fogml.static_svg import Curve, line_figure

if TYPE_CHECKING:
    import plotly.graph_objects as go

BEFORE, AFTER, OTHERS = "#3B4048", "#009E73", ("#0072B2", "#D55E00", "#CC79A7", "#E69F00")
_POINTS = 1000
"""Points of a curve in a notebook's picture, which is some 640 px wide."""
_MOST_PANELS = 6


@dataclass(frozen=True)
class Panel:
    """Curves over one axis; titles carry their units."""

    curves: Sequence[Curve]
    x_title: str
    y_title: str


class Pictured:
    """What shows itself: ``plot()`` gives a figure, and a notebook shows its heading and pictures."""

    def _heading(self) -> Sequence[str]:
        """A headline and further lines."""
        raise NotImplementedError

    def _panels(self) -> Sequence[Panel]:
        """What is drawn, from the top."""
        raise NotImplementedError

    def __str__(self) -> str:
        return "\n".join(str(line) for line in self._heading() if line)

    def _repr_html_(self) -> str:
        head, *lines = self._heading()
        panels = self._panels()
        parts = [Markup("<strong>") + markup(head) + Markup("</strong>")]
        parts += [Markup("<br>") + markup(line) for line in lines]
        for panel in panels[:_MOST_PANELS]:
            alt = f"{panel.y_title} over {panel.x_title}: {', '.join(c.label for c in panel.curves)}"
            picture = line_figure(list(panel.curves), panel.x_title, panel.y_title, alt)
            parts.append(Markup('<div style="max-width: 720px">') + picture + Markup("</div>"))
        if len(panels) > _MOST_PANELS:
            parts.append(markup(f"{len(panels) - _MOST_PANELS} more; plot() draws all."))
        return Markup("<div>") + Markup("").join(parts) + Markup("</div>")

    def plot(self) -> go.Figure:
        """The pictures as one plotly figure, a panel below the other."""
        from plotly.subplots import make_subplots

        panels = self._panels()
        shared = len({panel.x_title for panel in panels}) == 1
        figure = make_subplots(rows=max(len(panels), 1), cols=1, shared_xaxes=shared)
        dashes = {"": "solid", "4 3": "dash"}
        shown: set[str] = set()
        for row, panel in enumerate(panels, 1):
            for curve in panel.curves:
                figure.add_scatter(
                    x=curve.x,
                    y=curve.y,
                    name=figure_text(curve.label),
                    mode="lines+markers" if curve.dots else "lines",
                    line={"color": curve.colour, "dash": dashes.get(curve.dash, curve.dash)},
                    showlegend=curve.label not in shown,
                    legendgroup=figure_text(curve.label),
                    row=row,
                    col=1,
                )
                shown.add(curve.label)
            figure.update_yaxes(title_text=figure_text(panel.y_title), row=row, col=1)
            if not shared or row == len(panels):
                figure.update_xaxes(title_text=figure_text(panel.x_title), row=row, col=1)
        head = self._heading()[0]
        figure.update_layout(
            title_text=figure_text(head), height=140 + 220 * max(len(panels), 1), template="simple_white"
        )
        return figure


def in_time(time_s: object, values: object, label: str, colour: str) -> Curve:
    """A curve over time [h], with as many points as a picture shows."""
    time, shown = drawn(time_s, values, _POINTS)  # type: ignore[arg-type]
    return Curve(time / 3600.0, shown, colour, label=label)
