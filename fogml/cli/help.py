"""Help whose names stay whole: lines break between words, not at the hyphens of options and files."""

from __future__ import annotations

from collections.abc import Iterable

import click

_HYPHEN = "\ue000"
"""Stands for a hyphen while lines are broken; click breaks at every real one."""


class _Formatter(click.HelpFormatter):
    def write_text(self, text: str) -> None:
        super().write_text(text.replace("-", _HYPHEN))

    def write_dl(self, rows: Iterable[tuple[str, str]], *args: int, **more: int) -> None:
        super().write_dl([(name, text.replace("-", _HYPHEN)) for name, text in rows], *args, **more)

    def getvalue(self) -> str:
        return super().getvalue().replace(_HYPHEN, "-")


class HelpContext(click.Context):
    """The context of a command or group."""

    formatter_class = _Formatter
