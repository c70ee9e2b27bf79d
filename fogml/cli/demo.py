"""``fogml demo``: the main job on a real recording that ships."""

from __future__ import annotations

from typing import ClassVar

from fogml.cli import options
from fogml.cli.settings import Settings


class DemoSettings(Settings):
    """Train and judge on a real recording that ships, then say what to open.

    Trains on the up leg of a chamber cycle and judges on the last down leg, three axes. Writes
    x/, y/ and z/, each as 'train' does, and index.html.
    """

    job: ClassVar[str] = "fogml.cli.demo_job:demo_and_write"
    out: options.Folder = "demo-results"
