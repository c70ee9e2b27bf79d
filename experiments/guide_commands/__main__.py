"""Every command of README and docs/, run as it stands: ``python -m experiments.guide_commands DIR``.

The blocks of shell run one after another in DIR, which is a fresh copy of the checkout: what one page
makes the next may use. Exit status 1 says that one of them failed; each is told with its status and time.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
NEEDS_NETWORK = ("pip ", "python3 -m venv", "make ", "jupyter ")
"""What begins a line that is left out: it installs, or takes as long as the test suite."""


def pages() -> list[Path]:
    """The README, and the pages in the order of the list on the first."""
    from fogml.cli.docs_job import page_names

    docs = ROOT / "docs"
    return [ROOT / "README.md", *(docs / f"{name}.md" for name in page_names(docs))]


def lines_of(path: Path, language: str = "sh") -> Iterator[str]:
    """The lines of a page's blocks of shell, without comments."""
    for block in blocks_of(path, language):
        for line in block.splitlines():
            command = line.split("  #")[0].strip()
            if command and not command.startswith("#"):
                yield command


def blocks_of(path: Path, language: str) -> list[str]:
    """The fenced blocks of a page in one language."""
    text = path.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)


def files_of(path: Path) -> dict[str, str]:
    """Files that a page tells to write: a name in backticks before a block that is no command."""
    text = path.read_text(encoding="utf-8")
    told = re.findall(
        r"`([\w-]+\.(?:yaml|csv))`[^`]*:\n\n```(?:yaml|text)\n(.*?)^```", text, re.MULTILINE | re.DOTALL
    )
    return dict(told)


def main(folder: Path) -> int:
    """Run all; the number of commands that failed."""
    ignored = shutil.ignore_patterns(".git", ".venv", "__pycache__", "*.egg-info", "_build")
    shutil.copytree(ROOT, folder, ignore=ignored)
    failed = 0
    for path in pages():
        for name, text in files_of(path).items():
            (folder / name).write_text(text, encoding="utf-8")
        for line in lines_of(path):
            if line.startswith((*NEEDS_NETWORK, ". ")):
                continue
            begun = time.monotonic()
            done = subprocess.run(["bash", "-c", line], cwd=folder, capture_output=True, text=True)
            print(f"{path.name}: {done.returncode} in {time.monotonic() - begun:.0f} s: {line}", flush=True)
            # A limit that is missed is a result.
            if done.returncode not in (0, 1) or "Traceback" in done.stderr:
                failed += 1
                print(done.stderr.strip(), flush=True)
    return failed


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(1 if main(Path(sys.argv[1])) else 0)
