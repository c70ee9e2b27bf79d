"""One headless Chromium for many pages, spoken to over its debugging pipe (Chrome DevTools Protocol)."""

from __future__ import annotations

import base64
import fcntl
import json
import os
import select
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

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
    "--hide-scrollbars",
    "--disable-background-timer-throttling",
    "--disable-renderer-backgrounding",
    # No name resolves: a page that needs anything from elsewhere fails here as it does offline.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    "--remote-debugging-pipe",
)
_SCREEN = {"width": 1366, "height": 900, "deviceScaleFactor": 1, "mobile": False}
_SHEET = {**_SCREEN, "width": 672}
"""What margins leave of a sheet of A4."""
_LONGEST_ANSWER_S = 120.0


@dataclass
class Opened:
    """A page that is open, and what its console has said."""

    browser: Browser
    session: str
    target: str
    console: list[str] = field(default_factory=list)
    loads: set[str] = field(default_factory=set)
    """Navigations whose page has loaded; the empty page that comes first is one."""

    def tell(self, script: str) -> Any:
        """The value of a script in the page."""
        answer = self.ask("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def ask(self, method: str, **parameters: Any) -> Any:
        """The answer of the browser."""
        return self.browser.ask(method, self.session, **parameters)

    def on_paper(self, paper: bool) -> None:
        """Lay the page out for a sheet of A4, or for the screen again."""
        self.ask("Emulation.setEmulatedMedia", media="print" if paper else "")
        self.ask("Emulation.setDeviceMetricsOverride", **(_SHEET if paper else _SCREEN))
        # What a page does before it is printed it does here too.
        self.tell(f"void window.dispatchEvent(new Event({'beforeprint' if paper else 'afterprint'!r}))")

    def printed(self) -> bytes:
        """The page as PDF, as a browser prints it."""
        held = self.ask("Page.printToPDF", preferCSSPageSize=True, printBackground=True)
        return base64.b64decode(held["data"])

    def close(self) -> None:
        """Close the page."""
        self.browser.ask("Target.closeTarget", targetId=self.target)


class Browser:
    """The browser's process."""

    def __init__(self, profile: Path) -> None:
        theirs_in, ours_out = os.pipe()
        ours_in, theirs_out = os.pipe()
        command = [str(CHROMIUM), *_FLAGS, f"--user-data-dir={profile}", "about:blank"]

        def joined() -> None:
            """It reads from 3 and writes to 4."""
            above = [fcntl.fcntl(one, fcntl.F_DUPFD, 10) for one in (theirs_in, theirs_out)]
            for number, one in enumerate(above, start=3):
                os.dup2(one, number)

        self.process = subprocess.Popen(
            command, preexec_fn=joined, pass_fds=(3, 4), stderr=subprocess.DEVNULL
        )
        os.close(theirs_in)
        os.close(theirs_out)
        self.out, self.into, self.ahead = ours_out, ours_in, b""
        self.number = 0
        self.pages: dict[str, Opened] = {}

    def open(self, page: Path) -> Opened:
        """Open a page, and wait until its figures are drawn."""
        opened = self.open_at(page.as_uri())
        figures = opened.tell('document.querySelectorAll(".plot").length')
        while figures and not opened.console and not opened.tell('!!document.querySelector("[data-drawn]")'):
            time.sleep(0.02)
        return opened

    def open_at(self, address: str) -> Opened:
        """Open an address, and wait until it has loaded."""
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        opened = self.pages[session] = Opened(self, session, target)
        for domain in ("Page", "Runtime", "Log"):
            opened.ask(f"{domain}.enable")
        opened.ask("Page.setLifecycleEventsEnabled", enabled=True)
        opened.on_paper(False)
        navigation = opened.ask("Page.navigate", url=address)["loaderId"]
        while navigation not in opened.loads:
            self._hear()
        return opened

    def ask(self, method: str, session: str | None = None, **parameters: Any) -> Any:
        """The answer to a request."""
        self.number += 1
        told: dict[str, Any] = {"id": self.number, "method": method, "params": parameters}
        content = json.dumps(told | ({"sessionId": session} if session else {})).encode() + b"\0"
        while content:
            content = content[os.write(self.out, content) :]
        while True:
            answer = self._hear()
            if answer.get("id") == self.number:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]

    def _hear(self) -> dict[str, Any]:
        """The next answer or event; what a console says is kept."""
        while b"\0" not in self.ahead:
            assert select.select([self.into], [], [], _LONGEST_ANSWER_S)[0], "Chromium does not answer"
            part = os.read(self.into, 1 << 20)
            assert part, "Chromium ended"
            self.ahead += part
        line, _, self.ahead = self.ahead.partition(b"\0")
        event: dict[str, Any] = json.loads(line)
        page = self.pages.get(event.get("sessionId", ""))
        told = event.get("params", {})
        if page is not None and event.get("method") == "Page.lifecycleEvent":
            page.loads |= {told["loaderId"]} if told["name"] == "load" else set()
        elif page is not None and event.get("method") == "Runtime.consoleAPICalled":
            page.console.append(" ".join(str(one.get("value", "")) for one in told["args"]))
        elif page is not None and event.get("method") == "Runtime.exceptionThrown":
            details = told["exceptionDetails"]
            page.console.append(details.get("exception", {}).get("description", details["text"]))
        elif page is not None and event.get("method") == "Log.entryAdded":
            page.console.append(told["entry"]["text"])
        return event

    def close(self) -> None:
        """End the browser."""
        self.process.kill()
        self.process.wait()
        os.close(self.out)
        os.close(self.into)
