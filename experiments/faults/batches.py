"""Many cases in forked children: a crash or a hang is told of the very input, and the rest goes on."""

from __future__ import annotations

import contextlib
import faulthandler
import functools
import gc
import json
import os
import resource
import selectors
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from experiments.faults.sandbox import Limits, Outcome, Sandbox
from experiments.faults.started import ORPHANS_S

_POLL_S = 0.5
_OVERHEAD_BYTES = 3 << 30
"""Address space beyond memory: what libraries reserve and do not use."""


class _Child:
    """A forked process that does some of the cases."""

    def __init__(
        self, todo: Sequence[int], do: Callable[[int, Path], Outcome], home: Path, limits: Limits
    ) -> None:
        self.todo = list(todo)
        self.home = home
        self.current: int | None = None
        self.since, self.used = time.monotonic(), 0.0
        self.held = b""
        receiver, sender = os.pipe()
        sys.stdout.flush()
        sys.stderr.flush()
        self.process = os.fork()
        if self.process == 0:
            status = 1
            try:
                os.close(receiver)
                os.setsid()
                faulthandler.disable()
                _bound(limits)
                for index in self.todo:
                    _say(sender, {"begins": index})
                    _say(sender, {"done": index, **asdict(do(index, home))})
                status = 0
            except Exception:
                _say(sender, {"broken": traceback.format_exc()})
            finally:
                os._exit(status)
        os.close(sender)
        self.receiver = receiver

    def begins(self, index: int) -> None:
        """Note when a case began."""
        self.current, self.since, self.used = index, time.monotonic(), self.cpu_s()

    def cpu_s(self) -> float:
        """Processor time of the process so far [s]."""
        fields = Path(f"/proc/{self.process}/stat").read_text(encoding="ascii", errors="replace")
        user, system = fields.rpartition(")")[2].split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")

    def over(self, limits: Limits) -> str:
        """Which limit the case has passed while it still runs; empty for none."""
        if self.current is None:
            return ""
        if time.monotonic() - self.since > limits.wall_s:
            return f"killed after {limits.wall_s:g} s"
        return (
            f"killed after {limits.cpu_s:g} s of processor time"
            if self.cpu_s() - self.used > limits.cpu_s
            else ""
        )

    def heard(self) -> list[dict[str, Any]] | None:
        """What the child has said since; None at its end."""
        part = os.read(self.receiver, 1 << 20)
        if not part:
            return None
        *lines, self.held = (self.held + part).split(b"\n")
        return [json.loads(line) for line in lines]

    def ended(self) -> tuple[int, bool]:
        """How the process ended, and whether some of its own processes went on."""
        os.close(self.receiver)
        _, status = os.waitpid(self.process, 0)
        until = time.monotonic() + ORPHANS_S
        with contextlib.suppress(ProcessLookupError):
            while time.monotonic() < until:
                os.killpg(self.process, 0)
                time.sleep(0.01)
            os.killpg(self.process, signal.SIGKILL)
            return self._gone(status, True)
        return self._gone(status, False)

    def _gone(self, status: int, left: bool) -> tuple[int, bool]:
        shutil.rmtree(self.home, ignore_errors=True)
        return status, left


def _bound(limits: Limits) -> None:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + limits.memory_bytes + _OVERHEAD_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _say(pipe: int, values: dict[str, Any]) -> None:
    held = json.dumps(values).encode() + b"\n"
    while held:
        held = held[os.write(pipe, held) :]


def outcomes(
    count: int,
    do: Callable[[int, Path], Outcome],
    home: Path,
    limits: Limits,
    *,
    workers: int = 1,
    batch: int = 100,
) -> Iterator[tuple[int, Outcome]]:
    """The outcome of each of `count` cases, as they come.

    Parameters
    ----------
    count
        Cases are known by their numbers from 0.
    do
        Does one in a folder; called in a forked child.
    home
        Folder for the children's own.
    limits
        What a case may take.
    workers
        Children at a time.
    batch
        Cases that a child does in its life.
    """
    waiting = [list(range(start, min(start + batch, count))) for start in range(0, count, batch)][::-1]
    # What is loaded already is never looked through again, nor copied.
    gc.collect()
    gc.freeze()
    chosen = selectors.DefaultSelector()
    started = 0

    def start() -> None:
        nonlocal started
        child = _Child(waiting.pop(), do, home / f"child-{started}", limits)
        started += 1
        chosen.register(child.receiver, selectors.EVENT_READ, child)

    try:
        while waiting or chosen.get_map():
            while waiting and len(chosen.get_map()) < workers:
                start()
            for key, _ in chosen.select(_POLL_S):
                child: _Child = key.data
                said = child.heard()
                for message in said or ():
                    if "broken" in message:
                        raise RuntimeError(f"the examination itself failed: {message['broken']}")
                    if "begins" in message:
                        child.begins(message["begins"])
                    else:
                        index = message.pop("done")
                        child.todo.remove(index)
                        child.current = None
                        yield index, Outcome(**message)
                if said is None:
                    chosen.unregister(child.receiver)
                    yield from _end(child, waiting)
            for key in list(chosen.get_map().values()):
                child = key.data
                if told := child.over(limits):
                    chosen.unregister(child.receiver)
                    os.killpg(child.process, signal.SIGKILL)
                    yield from _end(child, waiting, hung=told)
    finally:
        for key in list(chosen.get_map().values()):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(key.data.process, signal.SIGKILL)
            key.data.ended()


def _end(child: _Child, waiting: list[list[int]], hung: str = "") -> Iterator[tuple[int, Outcome]]:
    """What is said of the case in which a child ended; the cases after it wait again."""
    status, left = child.ended()
    if status and child.current is None:
        child.current = child.todo[0] if child.todo else None
    if child.current is not None:
        child.todo.remove(child.current)
        ended = f"signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else f"status {status >> 8}"
        told = {"hang": hung} if hung else {"crash": ended}
        yield child.current, Outcome(None, told)
    elif left and not child.todo:
        yield -1, Outcome(None, {"left": "processes went on after the last case of a batch"})
    if child.todo:
        waiting.append(child.todo)


@functools.cache
def sandbox(home: Path, limits: Limits, compare: Any) -> Sandbox:
    """The one sandbox of a child's folder; output is caught until the child ends."""
    made = Sandbox(home, limits, compare)
    made.stack.enter_context(made.catching())
    return made
