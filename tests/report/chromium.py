"""Opens pages in headless Chromium and reads back what they became."""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

CHROMIUM = Path("/usr/bin/chromium")
_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    # No name resolves: a page that needs anything from elsewhere fails here as it does offline.
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--enable-logging=stderr",
    "--window-size=1366,900",
)
_CONSOLE = re.compile(r"CONSOLE[:(]\d+\)?\] (.*)")


@dataclass(frozen=True)
class Opened:
    """What became of a page: its document after load, and what its console said."""

    dom: str
    console: list[str]


def open_page(page: Path, profile: Path) -> Opened:
    """Open a page, let its figures be drawn, and return document and console."""
    answer = _run(profile, "--virtual-time-budget=20000", "--dump-dom", page.as_uri())
    return Opened(answer.stdout, _CONSOLE.findall(answer.stderr))


def print_page(page: Path, profile: Path) -> tuple[bytes, list[str]]:
    """The page as PDF, as a browser prints it, and what its console said."""
    pdf = page.with_suffix(".pdf")
    answer = _run(profile, "--no-pdf-header-footer", f"--print-to-pdf={pdf}", page.as_uri())
    return pdf.read_bytes(), _CONSOLE.findall(answer.stderr)


def _run(profile: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [str(CHROMIUM), *_FLAGS, f"--user-data-dir={profile}", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
