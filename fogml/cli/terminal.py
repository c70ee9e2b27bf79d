"""What a command prints: the result on stdout, everything else on stderr."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

import click

from fogml.escaping import terminal_text, visible
from fogml.json_files import json_text

_LINE_EVERY_S = 10.0
"""Where stderr is no terminal, a line on long work this often."""


class Work(Protocol):
    """Long work under way."""

    def advance(self, amount: float = 1.0, doing: str | None = None) -> None:
        """Say that `amount` more is done, and what comes next."""

    def doing(self, what: str) -> None:
        """Say what is being done."""

    def reached(self, done: float, total: float, doing: str) -> None:
        """Say how much of how much is done, where that is known only on the way."""


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
            click.echo(terminal_text(text), err=True)

    def say(self, text: str) -> None:
        """A line on stdout for people."""
        if not (self.quiet or self.as_json):
            click.echo(terminal_text(text))

    def markdown(self, text: str) -> None:
        """Markdown on stdout for people, as headings, lists and tables."""
        if self.quiet or self.as_json:
            return
        from rich.console import Console
        from rich.markdown import Markdown

        Console(markup=False).print(Markdown(terminal_text(text)))

    def result(self, values: Any) -> None:
        """The result on stdout, where JSON is asked for."""
        if self.as_json:
            click.echo(json_text(values, "result", ascii_only=True))

    def table(self, title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """A table on stdout for people: the first column left, the others right; no head if it names none."""
        if self.quiet or self.as_json:
            return
        from rich import box
        from rich.console import Console
        from rich.table import Table

        table = Table(title=terminal_text(title), title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
        table.show_header = any(header)
        console = Console(highlight=False, markup=False)
        columns = [[terminal_text(cell) for cell in cells] for cells in zip(header, *rows, strict=True)]
        widths = _column_widths(columns, console.width)
        for number, name in enumerate(header):
            # Where whole words don't fit they break anywhere rather than be cut: a figure is never lost.
            width = widths[number] if widths else None
            table.add_column(name, justify="right" if number else "left", overflow="fold", width=width)
        for row in rows:
            table.add_row(*map(terminal_text, row))
        console.print(table)

    @contextmanager
    def work(self, what: str, total: float | None = None) -> Iterator[Work]:
        """Show progress on stderr, with the time left where `total` is known."""
        if self.quiet:
            yield _Silent()
        elif sys.stderr.isatty():
            with _bar(what, total) as work:
                yield work
        else:
            yield _Lines(what, total)


_BETWEEN = 3
"""Characters between two columns of a table."""


def _column_widths(columns: Sequence[Sequence[str]], width: int) -> list[int] | None:
    """Widths in which no word is broken, wider where there is room; None where words alone don't fit."""
    whole = [max(map(len, cells)) for cells in columns]
    widths = [max((len(word) for cell in cells for word in cell.split()), default=1) for cells in columns]
    room = width - _BETWEEN * len(columns) - sum(widths)
    if room < 0:
        return None
    for _ in range(room):
        short = [most - held for most, held in zip(whole, widths, strict=True)]
        if max(short) <= 0:
            break
        widths[short.index(max(short))] += 1
    return widths


class _Silent:
    def advance(self, amount: float = 1.0, doing: str | None = None) -> None:
        """Nothing is shown."""

    def doing(self, what: str) -> None:
        """Nothing is shown."""

    def reached(self, done: float, total: float, doing: str) -> None:
        """Nothing is shown."""


class _Lines:
    """A line now and then, for logs."""

    def __init__(self, what: str, total: float | None) -> None:
        self._what = what
        self._total = total
        self._done = 0.0
        self._began = self._shown = time.monotonic()

    def advance(self, amount: float = 1.0, doing: str | None = None) -> None:
        self._done += amount
        self.doing(doing or self._what)

    def reached(self, done: float, total: float, doing: str) -> None:
        self._done, self._total = done, total
        self.doing(doing)

    def doing(self, what: str) -> None:
        self._what = what
        now = time.monotonic()
        if now - self._shown < _LINE_EVERY_S:
            return
        self._shown = now
        spent = now - self._began
        text = f"{what}: {spent:.0f} s"
        if self._total and self._done:
            left = spent * (self._total - self._done) / self._done
            text = f"{what}: {self._done / self._total:.0%}, about {left:.0f} s left"
        click.echo(terminal_text(text), err=True)


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

    columns = [
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left:"),
        TimeRemainingColumn(),
    ]
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(visible(what), total=total)

        class Bar:
            def advance(self, amount: float = 1.0, doing: str | None = None) -> None:
                progress.advance(task, amount)
                if doing is not None:
                    progress.update(task, description=visible(doing))

            def doing(self, what: str) -> None:
                progress.update(task, description=visible(what))

            def reached(self, done: float, total: float, doing: str) -> None:
                progress.update(task, completed=done, total=total, description=visible(doing))

        yield Bar()


def number(value: float | None) -> str:
    """A figure for a table: four significant digits; a dash where there is none.

    Powers of ten only below 1e-4 and from 1e7 on.
    """
    if value is None:
        return "–"
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.4g}"
