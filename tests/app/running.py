"""A server of the app in a process of its own, as a person starts it."""

from __future__ import annotations

import http.client
import json
import os
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit


class Running:
    """``fogml app`` of a folder, on a free port."""

    def __init__(self, folder: Path, *more: str) -> None:
        self.folder = folder
        command = [sys.executable, "-m", "fogml", "app", str(folder), "--port", "0", "--json", *more]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, env={**os.environ, "PYTHONUNBUFFERED": "1"}, text=True
        )
        assert self.process.stdout is not None
        told = ""
        while True:
            told += self.process.stdout.readline()
            try:
                self.address = json.loads(told)["address"]
                break
            except ValueError:
                assert self.process.poll() is None, told
        parts = urlsplit(self.address)
        self.host, self.token = parts.netloc, parts.query.removeprefix("token=")

    def ask(
        self, method: str, path: str, body: Any = None, **headers: str
    ) -> tuple[int, str, dict[str, str]]:
        """Status, text and headers of an answer; what the page itself sends stands in the headers."""
        connection = http.client.HTTPConnection(self.host, timeout=30)
        port = self.host.partition(":")[2]
        sent = {"Host": self.host, "X-Fogml": "1", "Cookie": f"fogml-app-{port}={self.token}"}
        sent |= {name.replace("_", "-"): value for name, value in headers.items()}
        content = body if isinstance(body, bytes) or body is None else json.dumps(body)
        with closing(connection):
            connection.request(method, path, content, {name: value for name, value in sent.items() if value})
            answer = connection.getresponse()
            return answer.status, answer.read().decode("utf-8", "replace"), dict(answer.getheaders())

    def kill(self) -> None:
        """End it without a word."""
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()
