"""What a command prints: the result on stdout, everything else on stderr."""

from __future__ import annotations

import os
import re
import shutil
import sys
import textwrap
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING, Any, TextIO

import click

from fogml.escaping import terminal_text, visible
from fogml.json_files import json_text
from fogml.numerals import percent
from fogml.processes import heed_interrupt

if TYPE_CHECKING:
    from fogml.arrays import FloatArray
    from fogml.report.page import Tile
    from fogml.report.tables import Table

_LINE_EVERY_S = 10.0
"""Where stderr is no terminal, a line on long work this often."""


class Work:
    """Long work under way, of which nothing is shown."""

    def __init__(self, what: str, total: float | None) -> None:
        self._what, self._done, self._total = what, 0.0, total

    def advance(self, amount: float = 1.0, doing: str | None = None) -> None:
        """Say that `amount` more is done, and what comes next."""
        self._done += amount
        self.doing(doing or self._what)

    def doing(self, what: str) -> None:
        """Say what is being done."""
        heed_interrupt()
        self._what = what
        self._show()

    def reached(self, done: float, total: float, doing: str) -> None:
        """Say how much of how much is done, where that is known only on the way."""
        self._done, self._total = done, total
        self.doing(doing)

    def _show(self) -> None:
        """Show where it is."""


class Terminal:
    """Where a command prints to.

    Parameters
    ----------
    as_json
        Print the result alone, as JSON.
    quiet
        Print nothing but the result as JSON, if asked for, and errors.
    """

    def __init__(self, as_json: bool = False, quiet: bool = False) -> None:
        self.as_json = as_json
        self.quiet = quiet

    def note(self, text: str) -> None:
        """A line on stderr."""
        if not self.quiet:
            # Not by click, which passes over the bar's hold on stderr and writes into its line.
            print(fitted(text, sys.stderr), file=sys.stderr)

    def say(self, text: str) -> None:
        """A line on stdout for people."""
        if not (self.quiet or self.as_json):
            click.echo(fitted(text, sys.stdout))

    def markdown(self, text: str) -> None:
        """Markdown on stdout for people, as headings, lists and tables."""
        if self.quiet or self.as_json:
            return
        from rich.console import Console
        from rich.markdown import Markdown

        Console(markup=False).print(Markdown(terminal_text(text, sys.stdout.encoding)))

    def curve(self, values: FloatArray) -> None:
        """A curve on stdout for people, no wider than the terminal; none where an encoding lacks the dots."""
        from fogml.pictures import braille

        text = "\n".join(braille(values, min(_CURVE, shutil.get_terminal_size().columns)))
        if terminal_text(text, sys.stdout.encoding) == text:
            self.say(text)

    def result(self, values: Any) -> None:
        """The result on stdout, where JSON is asked for."""
        if self.as_json:
            click.echo(json_text(values, "result", ascii_only=True))

    def table(self, title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """A table on stdout for people: figures right, all else left; no head if it names none."""
        if self.quiet or self.as_json:
            return
        from rich import box
        from rich.console import Console
        from rich.table import Table

        if title:
            self.say(title)
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
        table.show_header = any(header)
        # In a file or a pipe a row is a line.
        bounded = sys.stdout.isatty() or "COLUMNS" in os.environ
        console = Console(highlight=False, markup=False, width=None if bounded else _UNBOUNDED)
        told = (header, *([_in_a_word(cell) for cell in cells] for cells in rows))
        lines = [[terminal_text(cell, sys.stdout.encoding) for cell in cells] for cells in told]
        columns = list(zip(*lines, strict=True))
        # Columns move together before a word breaks.
        widths = _column_widths(columns, console.width - _BETWEEN * len(columns))
        if widths is None:
            widths = _column_widths(columns, console.width - len(columns) - 1)
            table.padding = (0, 0, 0, 0)
        for number, (name, *_) in enumerate(columns):
            # Where whole words don't fit they break anywhere rather than be cut: a figure is never lost.
            width = widths[number] if widths else None
            right = number > 0 and _holds_figures(columns[number][1:])
            table.add_column(name, justify="right" if right else "left", overflow="fold", width=width)
        for row in lines[1:]:
            table.add_row(*row)
        console.print(table)

    def show(self, table: Table | None, title: str = "", most: int | None = None) -> None:
        """A page's table on stdout under a title or its caption; at most so many rows, none of no table."""
        if table is None:
            return
        heads = [f"{name} [{unit}]" if unit else name for name, unit, _ in table.columns]
        rows = [list(row.cells) for row in table.rows[:most]]
        if any(row.mark == "chosen" for row in table.rows):
            heads.append("chosen")
            for row, cells in zip(table.rows, rows):
                cells.append("✓" if row.mark == "chosen" else "")
        self.table(title or table.caption, heads, rows)

    def tiles(self, tiles: Iterable[Tile]) -> None:
        """A page's headline figures, a line each."""
        for tile in tiles:
            note = f", {tile.note}" if tile.note else ""
            self.say(f"{tile.name}: {f'{tile.value} {tile.unit}'.strip()}{note}")

    @contextmanager
    def work(self, what: str, total: float | None = None) -> Iterator[Work]:
        """Show progress on stderr, with the time left where `total` is known."""
        if self.quiet:
            yield Work(what, total)
        elif sys.stderr.isatty():
            with _bar(what, total) as work:
                yield work
        else:
            yield _Lines(what, total)


def fitted(text: str, stream: TextIO) -> str:
    """Text for a stream: in a terminal a sentence breaks between words, and no name or figure in the middle.

    Blocks of lines and commands stay as they are, to be copied.
    """
    text = terminal_text(text, stream.encoding)
    if "\n" in text or text.startswith("fogml ") or not stream.isatty():
        return text
    width = shutil.get_terminal_size().columns
    below = " " * (len(text) - len(text.lstrip()) + 2)
    return textwrap.fill(text, width, subsequent_indent=below, break_long_words=False, break_on_hyphens=False)


_CURVE = 60
"""Most characters that a curve is wide: with some beside it in a terminal of 80."""
_UNBOUNDED = 10_000
"""Width of a table that nobody sees in a terminal [characters]."""
_FIGURE = re.compile("[-−+]?[0-9]")
_BETWEEN = 3
"""Characters between two columns of a table."""


def _holds_figures(cells: Sequence[str]) -> bool:
    """Whether most of the cells that hold anything begin with a figure."""
    held = [cell for cell in cells if cell not in ("", "–")]
    return 2 * sum(map(bool, map(_FIGURE.match, held))) >= len(held)


_SIGN = re.compile(r"^([≤≥±<>]) (?=[0-9])")


def _in_a_word(cell: str) -> str:
    """A figure with its power of ten, or the sign of a bound, as one word, which no line breaks."""
    return _SIGN.sub(r"\1", cell.replace(" × 10", "×10"))


def _column_widths(columns: Sequence[Sequence[str]], width: int) -> list[int] | None:
    """Widths in which no word is broken, wider where there is room; None where words alone don't fit."""
    from rich.cells import cell_len  # a Chinese sign takes two

    whole = [max(map(cell_len, cells)) for cells in columns]
    widths = [
        max((cell_len(word) for cell in cells for word in cell.split()), default=1) for cells in columns
    ]
    room = width - sum(widths)
    if room < 0:
        return None
    for _ in range(room):
        folds = [most / held for most, held in zip(whole, widths, strict=True)]
        if max(folds) <= 1.0:
            break
        widths[folds.index(max(folds))] += 1
    return widths


def _clock(seconds: float) -> str:
    """A time as the bar shows it: hours, minutes, seconds."""
    return str(timedelta(seconds=round(seconds)))


class _Lines(Work):
    """A line now and then, for logs."""

    def __init__(self, what: str, total: float | None) -> None:
        super().__init__(what, total)
        self._began = self._shown = time.monotonic()

    def _show(self) -> None:
        now = time.monotonic()
        if now - self._shown < _LINE_EVERY_S:
            return
        self._shown = now
        spent = now - self._began
        text = f"{self._what}: {_clock(spent)}"
        if self._total and self._done:
            left = spent * (self._total - self._done) / self._done
            text = f"{self._what}: {percent(self._done / self._total, 0)}, about {_clock(left)} left"
        click.echo(terminal_text(text, sys.stderr.encoding), err=True)


@contextmanager
def _bar(what: str, total: float | None) -> Iterator[Work]:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        SpinnerColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.table import Column

    columns = [
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False, table_column=Column(no_wrap=True, ratio=3)),
        BarColumn(bar_width=None, table_column=Column(ratio=2)),
        TimeElapsedColumn(),
        TextColumn("left:"),
        TimeRemainingColumn(),
    ]
    # Of a line that is too long the description is cut, not the times.
    with Progress(*columns, console=Console(stderr=True), transient=True, expand=True) as progress:
        task = progress.add_task(visible(what), total=total)

        class Bar(Work):
            def _show(self) -> None:
                described = visible(self._what)
                progress.update(task, completed=self._done, total=self._total, description=described)

        yield Bar(what, total)


UNITS_SHOWN = 40
"""Units that a table on the terminal holds; pages and files hold all."""
