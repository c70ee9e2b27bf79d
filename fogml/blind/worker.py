"""The sealed process that answers cases: one line of JSON in, one line out, many cases in a life.

``python -m fogml.blind.worker METHOD [CODE_FOLDER]`` in the folder that it may use; METHOD is
``package.module:function``, called with `CaseFiles`, the folder for its answer, and options.
"""

from __future__ import annotations

import json
import os
import sys
import time
import traceback
from pathlib import Path
from typing import Any

from fogml.blind.sealing import seal
from fogml.processes import begin_worker

READY = "ready"


def main(arguments: list[str]) -> int:
    """Seal the process, load the method, and answer until the input ends."""
    begin_worker()
    home = Path.cwd()
    code = [Path(path) for path in arguments[1:]]
    # What a library prints must not end up among the answers.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    locks = seal(home, code)
    sys.path[:0] = [str(path) for path in code]
    from fogml.blind.methods import load_method

    method = load_method(arguments[0])
    _say(answers, {READY: True, "locks": locks})
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
