"""The diagnosis of a blind case with its page, for the cases that a score links to.

Pages are drawn for those alone: each holds all that it shows, and a thousand of them fill a disk.
"""

from __future__ import annotations

from pathlib import Path

from fogml.blind.folders import CaseFiles
from fogml.blind.methods import diagnosis


def diagnosis_with_page(case: CaseFiles, out: Path) -> None:
    """Answer a case again, which gives the same numbers, and draw its report ``gap.html``."""
    from fogml.report import gap_page

    found = diagnosis(case, out)
    (out / "gap.html").write_text(gap_page(found), encoding="utf-8")
