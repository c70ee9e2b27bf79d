"""The marks of a suite, or of a part of one, as a small file: the schema ``fogml.blind_marks/1``.

Gzipped JSON. Truths stand in it once per case and without what no figure needs, so that a page of
many parts can be made where no part's cases, answers or truths lie.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

import fogml
from fogml.blind.folders import DIAGNOSIS
from fogml.blind.scoring.marks import Mark
from fogml.blind.truth import KINDS, Truth
from fogml.errors import InputError
from fogml.json_files import MOST_BYTES, parse_json
from fogml.outputs import whole_file

MARKS = "marks.json.gz"
SCHEMA = "fogml.blind_marks/1"
_REMEDY = "fogml blind score writes it"
_EFFECT_KEYS = {"id", "name", "stage", "form", "d_prime", "cosine"}
_TRUTH_KEYS: dict[str, Any] = {
    **dict.fromkeys(("schema_", "case", "seed", "kind", "reality", "runs", "sample_s", "turning"), True),
    **dict.fromkeys(("left_out", "d_prime", "mix"), True),
    "effects": {"__all__": _EFFECT_KEYS},
}


class Part(BaseModel):
    """Cases that were scored together.

    Attributes
    ----------
    file
        Base name of their marks' file.
    cases
        How many.
    first, last
        Numbers of the first and the last one.
    kinds
        How many of each kind.
    truth
        Hash of their truths' hashes.
    """

    model_config = ConfigDict(extra="ignore", frozen=True)
    file: str
    cases: int
    first: int
    last: int
    kinds: dict[str, int]
    truth: str


@dataclass(frozen=True)
class Marks:
    """Every method's marks of a suite's cases.

    Attributes
    ----------
    seed
        The suite's.
    sample_s
        Sample intervals [s].
    parts
        What was scored together, by number.
    truths
        Of every case, by number.
    methods
        Marks of each method, by number, over the parts in which it answered.
    """

    seed: int
    sample_s: tuple[float, ...]
    parts: tuple[Part, ...]
    truths: tuple[Truth, ...]
    methods: Mapping[str, Sequence[Mark]]

    @property
    def truth(self) -> str:
        """Hash of the truths' hashes; of several parts, of theirs."""
        if len(self.parts) == 1:
            return self.parts[0].truth
        return hashlib.sha256("\n".join(part.truth for part in self.parts).encode()).hexdigest()


class _Content(BaseModel):
    """The file's keys, marks apart."""

    model_config = ConfigDict(extra="ignore", frozen=True)
    schema_: Literal["fogml.blind_marks/1"] = Field(alias="schema")
    seed: int
    sample_s: tuple[float, ...]
    parts: tuple[Part, ...] = Field(min_length=1)
    truths: tuple[Truth, ...]
    methods: dict[str, list[dict[str, Any]]]


_MARK = TypeAdapter(Mark)


def part_of(truths: Sequence[Truth], digest: str, file: str = MARKS) -> Part:
    """The part that some truths make up; `digest` is the hash of their hashes."""
    counts = Counter(truth.kind for truth in truths)
    numbers = [int(truth.case) for truth in truths]
    return Part(
        file=file,
        cases=len(truths),
        first=min(numbers),
        last=max(numbers),
        kinds={kind: counts[kind] for kind in KINDS if counts[kind]},
        truth=digest,
    )


def write_marks(path: Path, marks: Marks) -> None:
    """Write a file of marks; the same marks give the same bytes."""
    values = {
        "schema": SCHEMA,
        "version": fogml.__version__,
        "seed": marks.seed,
        "sample_s": marks.sample_s,
        "truth": marks.truth,
        "cases": len(marks.truths),
        "parts": [part.model_dump(mode="json") for part in marks.parts],
        "truths": [
            truth.model_dump(mode="json", by_alias=True, include=_TRUTH_KEYS) for truth in marks.truths
        ],
        "methods": {method: [_stored(one) for one in found] for method, found in marks.methods.items()},
    }
    text = json.dumps(values, allow_nan=False, ensure_ascii=False, separators=(",", ":")) + "\n"
    with whole_file(path) as partial:
        partial.write_bytes(gzip.compress(text.encode("utf-8"), mtime=0))


def read_marks(path: Path) -> Marks:
    """The marks in a file; a file of one part gives that its own name.

    Raises
    ------
    InputError
        If it can't be read or breaks the schema; names the file and the key.
    """
    try:
        # Some bytes of a packed file may stand for gigabytes.
        with gzip.open(path) as file:
            text = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; {_REMEDY}") from None
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path}: holds no marks ({error}); {_REMEDY}") from None
    if len(text) > MOST_BYTES:
        raise InputError(f"{path}: is larger than {MOST_BYTES >> 20} MB; {_REMEDY}")
    values = parse_json(text, f"{path}: holds no marks", _REMEDY)
    try:
        content = _Content.model_validate(values)
    except ValidationError as error:
        raise _unfit(path, error) from None
    truths = {truth.case: truth for truth in content.truths}
    if any(truth.seed != content.seed for truth in content.truths):
        raise InputError(f"{path}: key 'truths': cases of another seed than {content.seed}")
    methods = {
        method: [_read(path, f"methods.{method}.{place}", one, truths) for place, one in enumerate(stored)]
        for method, stored in content.methods.items()
    }
    parts = content.parts
    if len(parts) == 1:
        parts = (parts[0].model_copy(update={"file": path.name}),)
    return Marks(content.seed, content.sample_s, parts, content.truths, methods)


def _stored(one: Mark) -> dict[str, Any]:
    # The truth stands apart; asdict would copy it whole.
    values = asdict(replace(one, truth=None))  # type: ignore[arg-type]
    del values["truth"]
    return {"case": one.truth.case, **values}


def _read(path: Path, key: str, stored: Mapping[str, Any], truths: Mapping[str, Truth]) -> Mark:
    truth = truths.get(str(stored.get("case")))
    if truth is None:
        raise InputError(f"{path}: key '{key}.case': a case without a truth")
    try:
        return _MARK.validate_python({**stored, "truth": truth})
    except ValidationError as error:
        raise _unfit(path, error, f"{key}.") from None


def _unfit(path: Path, error: ValidationError, before: str = "") -> InputError:
    first = error.errors()[0]
    key = before + ".".join(str(place) for place in first["loc"])
    return InputError(f"{path}: key '{key}': {first['msg']}; score the part anew (fogml blind score)")


def merged(paths: Sequence[Path]) -> Marks:
    """The marks in several files, whatever the files' order.

    A method that did not answer in a part counts over the others alone.

    Raises
    ------
    InputError
        If a file can't be read, parts are of several seeds or sample intervals, a method answered a
        case in two of them, or a case has two truths.
    """
    if not paths:
        raise InputError("no marks are given; name files that fogml blind score wrote")
    read = [(path, read_marks(path)) for path in paths]
    whence, first = read[0]
    truths: dict[str, tuple[Path, Truth]] = {}
    methods: dict[str, dict[str, tuple[Path, Mark]]] = {}
    for path, marks in read:
        if (marks.seed, marks.sample_s) != (first.seed, first.sample_s):
            raise InputError(
                f"{path}: is of {_words(marks)}, {whence} of {_words(first)}; merge parts of one suite"
            )
        for truth in marks.truths:
            other, held = truths.setdefault(truth.case, (path, truth))
            if held != truth:
                raise InputError(f"{path}: case {truth.case} is another one than in {other}")
        for method, found in marks.methods.items():
            own = methods.setdefault(method, {})
            for mark in found:
                other, _ = own.setdefault(mark.truth.case, (path, mark))
                if own[mark.truth.case][1] is not mark:
                    raise InputError(
                        f"{path}: holds an answer of {method} to case {mark.truth.case}, and so does "
                        f"{other}; give each case once"
                    )
    return Marks(
        seed=first.seed,
        sample_s=first.sample_s,
        parts=tuple(sorted((p for _, m in read for p in m.parts), key=lambda p: (p.first, p.file))),
        truths=tuple(truths[case][1] for case in sorted(truths, key=_number)),
        methods={
            method: [methods[method][case][1] for case in sorted(methods[method], key=_number)]
            for method in sorted(methods, key=lambda name: (name != DIAGNOSIS, name))
        },
    )


def _number(case: str) -> tuple[int, str]:
    return len(case), case


def _words(marks: Marks) -> str:
    return f"seed {marks.seed} sampled at {', '.join(f'{s:g} s' for s in marks.sample_s)}"
