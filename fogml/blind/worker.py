"""The sealed process that answers cases: one line of JSON in, one line out, many cases in a life.

``python -m fogml.blind.worker METHOD [CODE_FOLDER]`` in the folder that it may use; METHOD is
``package.module:function``, called with `CaseFiles`, the folder for its answer, and options.

It can't reach the truth: it may read its own code and one folder, write to that folder alone, and reach no
network. Two locks. An audit hook (PEP 578) refuses every open, listing, connection and child process that
Python knows of outside the allowed folders, on any system. Where the kernel has Landlock (Linux 5.13 and
later) it refuses the same to code below Python, threads and children included: TCP since Linux 6.7, signals
to other processes since 6.12. Neither is told where the truth lies.
"""

from __future__ import annotations

import ctypes
import json
import os
import sys
import sysconfig
import time
import traceback
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

from fogml.processes import begin_worker

_SYSTEM = ("/usr", "/lib", "/lib64", "/bin", "/etc", "/sys", "/dev", "/nix/store")
_PROC = ("self", "cpuinfo", "meminfo", "stat", "loadavg", "version", "filesystems", "mounts", "sys")
# Of other processes nothing: their environment holds what they were told.
_KERNELS = (
    "fogml.signals.allan_kernel",
    "fogml.signals.modes",
    "fogml.signals.random_noise",
    "fogml.signals.recursions",
    "fogml.signals.sine_kernel",
    "fogml.signals.whitening_kernels",
    "fogml.signals.window_kernels",
    "fogml.models.rbf.evaluate",
)
# Numba takes what was compiled before from a folder that it could write to when the module was loaded.
_LISTING = {"os.listdir", "os.scandir", "os.chdir"}
_CHANGING = {"os.truncate", "os.remove", "os.rmdir", "os.mkdir", "os.chmod", "os.chown", "os.utime"}
_PAIRS = {"os.rename", "os.link", "os.symlink"}
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_TALKING = {
    "socket.connect",
    "socket.bind",
    "socket.sendto",
    "socket.sendmsg",
    "socket.getaddrinfo",
    "socket.gethostbyname",
    "socket.gethostbyaddr",
}
_LEAVING = {"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork", "pty.spawn"}

# Numbers of the system calls are the same on every architecture that Linux has them on.
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_VERSION_FLAG, _PATH_BENEATH, _NO_NEW_PRIVILEGES = 1, 1, 38
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
_READING = _EXECUTE | _READ_FILE | _READ_DIR
# Rights that came with each version: all of the first, moves between folders, truncation.
_RIGHTS = {1: (1 << 13) - 1, 2: 1 << 13, 3: 1 << 14}
_FILE_RIGHTS = _EXECUTE | _WRITE_FILE | _READ_FILE | _RIGHTS[3]
_TCP, _TCP_SINCE = 3, 4
# To bind and to connect.
_SCOPES, _SCOPES_SINCE = 3, 6
# Sockets without a file, and signals, of processes that are not shut in.


class _RulesetAttributes(ctypes.Structure):
    _fields_ = [
        ("handled_access_fs", ctypes.c_uint64),
        ("handled_access_net", ctypes.c_uint64),
        ("scoped", ctypes.c_uint64),
    ]


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _layout_ = "ms"
    _fields_ = [("allowed_access", ctypes.c_uint64), ("parent_fd", ctypes.c_int32)]


class OutOfReach(PermissionError):
    """A sealed process asked for something that it must not see."""


def own_roots() -> tuple[Path, ...]:
    """What any sealed process may read: Python, packages, this one, the system's, what tells of itself."""
    import fogml

    stated = [sys.prefix, sys.base_prefix, sys.exec_prefix, *sysconfig.get_paths().values(), *_SYSTEM]
    stated += [str(Path(fogml.__file__).parent), *(f"/proc/{name}" for name in _PROC)]
    return tuple(sorted({Path(os.path.realpath(path)) for path in stated if os.path.exists(path)}))


def within(path: str | Path, roots: Iterable[Path]) -> bool:
    """Whether a path, its links followed, lies in one of the folders or is one."""
    real = Path(os.path.realpath(path))
    return any(real == root or root in real.parents for root in roots)


def seal(folder: Path, more: Iterable[Path] = ()) -> str:
    """Shut this process in, for good; returns the locks in use: ``landlock and audit`` or ``audit``.

    It may read and write in `folder`, and read `more` folders of code.
    """
    roots = tuple({*own_roots(), *(Path(os.path.realpath(path)) for path in more)})
    writable = (Path(os.path.realpath(folder)), Path("/dev/null"))
    locked = _landlock(roots, writable)
    sys.addaudithook(_hook((*roots, *writable), writable))
    return "landlock and audit" if locked else "audit"


def _hook(readable: tuple[Path, ...], writable: tuple[Path, ...]) -> Any:
    def check(path: Any, allowed: tuple[Path, ...] = writable) -> None:
        # Descriptors that are open already were checked when they were opened.
        if path is None or isinstance(path, int) or within(os.fsdecode(path), allowed):
            return
        raise OutOfReach(f"{os.fsdecode(path)}: out of reach of a sealed method")

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            check(arguments[0], writable if (arguments[2] or 0) & _WRITES else readable)
        elif event in _LISTING:
            check(arguments[0] if arguments else None, readable)
        elif event in _CHANGING:
            check(arguments[0])
        elif event in _PAIRS:
            check(arguments[0], readable if event == "os.symlink" else writable)
            check(arguments[1])
        elif event in _TALKING:
            raise OutOfReach(f"{event}: a sealed method reaches no network")
        elif event in _LEAVING:
            raise OutOfReach(f"{event}: a sealed method starts no other process")

    return hook


def _landlock(readable: Iterable[Path], writable: Iterable[Path]) -> bool:
    """Restrict this process by Landlock; False where the kernel has none."""
    if not sys.platform.startswith("linux"):
        return False
    library = ctypes.CDLL(None, use_errno=True)
    call = library.syscall
    call.restype = ctypes.c_long
    version = call(_CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(_VERSION_FLAG))
    if version < 1:
        return False
    everything = sum(rights for since, rights in _RIGHTS.items() if since <= version)
    attributes = _RulesetAttributes(
        everything, _TCP * (version >= _TCP_SINCE), _SCOPES * (version >= _SCOPES_SINCE)
    )
    # An older kernel takes the fields that it knows.
    size = ctypes.c_size_t(8 + 8 * (version >= _TCP_SINCE) + 8 * (version >= _SCOPES_SINCE))
    ruleset = call(_CREATE_RULESET, ctypes.byref(attributes), size, ctypes.c_uint32(0))
    if ruleset < 0:
        return False
    try:
        for paths, rights in ((readable, _READING), (writable, everything)):
            for path in paths:
                _allow(call, ruleset, path, rights)
        library.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0)
        return bool(call(_RESTRICT_SELF, ctypes.c_int(ruleset), ctypes.c_uint32(0)) == 0)
    finally:
        os.close(ruleset)


def _allow(call: Any, ruleset: int, path: Path, rights: int) -> None:
    try:
        descriptor = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    try:
        rule = _PathBeneath(rights if path.is_dir() else rights & _FILE_RIGHTS, descriptor)
        kind, none = ctypes.c_int(_PATH_BENEATH), ctypes.c_uint32(0)
        call(_ADD_RULE, ctypes.c_int(ruleset), kind, ctypes.byref(rule), none)
    finally:
        os.close(descriptor)


STARTED = {"locks": str, "code": str}
ANSWERED = {
    "case": str,
    "done": bool,
    "reason": str | None,
    "message": str,
    "seconds": float,
}
"""What a worker says once it is ready, and to each case, with the kinds of the values."""


def main(arguments: list[str]) -> int:
    """Seal the process, load the method, and answer until the input ends."""
    begin_worker()
    home = Path.cwd()
    code = [Path(path) for path in arguments[1:]]
    # What a library prints must not end up among the answers.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    for module in _KERNELS:
        import_module(module)
    locks = seal(home, code)
    sys.path[:0] = [str(path) for path in code]
    from fogml.blind.methods import code_state, load_method

    method = load_method(arguments[0])
    _say(answers, {"locks": locks, "code": code_state(arguments[0], *code)})
    for line in sys.stdin:
        _say(answers, _answer(method, home, line))
    return 0


def _answer(method: Any, home: Path, line: str) -> dict[str, Any]:
    from fogml.blind.folders import case_files
    from fogml.errors import FogmlError

    asked = json.loads(line)
    began = time.perf_counter()
    answer: dict[str, Any] = {"case": asked["case"], "done": True, "reason": None, "message": ""}
    try:
        method(
            case_files(home / asked["case"], asked["seed"]), home / asked["out"], **asked.get("options", {})
        )
    except FogmlError as error:
        answer |= {"done": False, "reason": "refused", "message": str(error)}
    except Exception as error:
        traceback.print_exc()
        answer |= {"done": False, "reason": "error", "message": f"{type(error).__name__}: {error}"}
    return answer | {"seconds": time.perf_counter() - began}


def _say(answers: Any, values: dict[str, Any]) -> None:
    answers.write(json.dumps(values) + "\n")
    answers.flush()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
