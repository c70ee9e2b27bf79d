"""One spoiled input: the command, its files, and what is known of the values in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Case:
    """A command and the files that its folder holds before.

    Attributes
    ----------
    command
        Arguments of ``fogml``, run in the case's folder.
    files
        Relative name to content.
    spoiled
        Name of the file that was spoiled, or empty where the command line was.
    """

    command: tuple[str, ...]
    files: Mapping[str, bytes] = field(default_factory=dict)
    spoiled: str = ""
