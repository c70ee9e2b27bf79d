"""JSON as it is written, with no number that is not finite, and as it is read: strict, bounded."""

from __future__ import annotations

import hashlib
import json
import math
import re
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn

from fogml.errors import InputError, other_schema, printable, quoted
from fogml.folders import with_slashes

MOST_BYTES = 256 << 20
"""Largest file that is read [bytes]: the results of a thousand units take a tenth of it."""
MOST_DEPTH = 64
"""Most brackets within each other: what the toolkit writes has at most a dozen."""
_LONE_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def read_json(path: Path, remedy: str, most_bytes: int = MOST_BYTES) -> Any:
    """The content of a JSON file.

    Parameters
    ----------
    path
        The file.
    remedy
        What to do if it is missing or damaged, for the message.
    most_bytes
        Largest file that is read [bytes].

    Raises
    ------
    InputError
        If it can't be read, is too large, or is not strict JSON; see `parse_json`.
    """
    return parse_json(read_bytes(path, remedy, most_bytes), str(path), remedy)


def read_bytes(path: Path, remedy: str, most_bytes: int = MOST_BYTES) -> bytes:
    """The bytes of a file of bounded size; a pipe in its place could be waited for without end."""
    try:
        kind = path.stat().st_mode
        if not (stat.S_ISREG(kind) or stat.S_ISDIR(kind)):
            raise InputError(f"{path}: is no ordinary file; {remedy}")
        with path.open("rb") as file:
            data = file.read(most_bytes + 1)
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: no such file{with_slashes(path) or f'; {remedy}'}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if len(data) > most_bytes:
        raise InputError(f"{path}: is larger than {most_bytes >> 20} MB; {remedy}")
    return data


def parse_json(text: str | bytes, source: str, remedy: str) -> Any:
    """The content of JSON text: each key once, every number finite, at most `MOST_DEPTH` deep.

    Whole numbers fit 64 bits, so that each of them is a float too.

    Raises
    ------
    InputError
        If it is anything else.
    """
    try:
        if isinstance(text, bytes):
            text = text.decode("utf-8")
        value = _DECODER.decode(text)
        _check_depth(value)
        if _LONE_SURROGATE.search(text):
            json.dumps(value, ensure_ascii=False).encode("utf-8")
    except UnicodeError:
        raise InputError(f"{source}: is not text in UTF-8; {remedy}") from None
    except json.JSONDecodeError as error:
        raise InputError(
            f"{source}, line {error.lineno}: cut short or damaged ({error.msg}); {remedy}"
        ) from None
    except RecursionError:
        raise InputError(f"{source}: is nested more than {MOST_DEPTH} deep; {remedy}") from None
    except ValueError as error:
        raise InputError(f"{source}: {error}; {remedy}") from None
    return value


def json_object(value: Any, source: str, schema: str, remedy: str) -> dict[str, Any]:
    """A value that was read, once it is known to be an object of a schema."""
    if not isinstance(value, dict) or value.get("schema") != schema:
        found = value.get("schema") if isinstance(value, dict) else type(value).__name__
        raise InputError(f"{source}: {other_schema(found, schema, remedy)}")
    return value


def content_hash(document: Mapping[str, Any], files: Mapping[str, bytes] | None = None) -> str:
    """SHA-256 over a JSON-ready document, however it is laid out in a file, and over files beside it."""
    text = json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False, default=_of_numpy)
    digest = hashlib.sha256(text.encode("ascii"))
    for name, data in sorted((files or {}).items()):
        digest.update(f"\n{json.dumps(name)} {len(data)}\n".encode("ascii"))
        digest.update(data)
    return digest.hexdigest()


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        seen: set[str] = set()
        for key, _ in pairs:
            if key in seen:
                raise ValueError(f"key {quoted(key)} is stated twice")
            seen.add(key)
    return found


def _whole(text: str) -> int:
    if len(text) > 20 or not -(2**63) <= int(text) < 2**64:
        raise ValueError(f"the number {printable(text)} is too large")
    return int(text)


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"the number {printable(text)} is too large")
    return value


def _no_number(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON")


def _check_depth(value: Any) -> None:
    level, depth = [value], 0
    while level:
        level = [
            item
            for holder in level
            if isinstance(holder, dict | list)
            for item in (holder.values() if isinstance(holder, dict) else holder)
            if isinstance(item, dict | list)
        ]
        depth += 1
        if depth > MOST_DEPTH:
            raise RecursionError


_DECODER = json.JSONDecoder(
    object_pairs_hook=_once, parse_int=_whole, parse_float=_finite, parse_constant=_no_number
)


FAR_OFF = "is a value in the input, or a setting, far too large or far too small?"
"""What to do about a result that is not finite."""


def write_json(path: str | Path, values: Any, indent: int | None = 2) -> None:
    """Write values as a JSON file.

    Raises
    ------
    InputError
        If a number is NaN or infinite, naming its key.
    """
    path = Path(path)
    path.write_text(json_text(values, path.name, indent) + "\n", encoding="utf-8")


def json_text(values: Any, name: str, indent: int | None = None, *, ascii_only: bool = False) -> str:
    """Values as the text of JSON.

    Parameters
    ----------
    values
        Mappings, lists, texts, numbers, those of numpy too.
    name
        What they are called in a message.
    indent
        Spaces for each level; None for one line.
    ascii_only
        Whether other characters are written as escapes, for a terminal of any encoding.

    Raises
    ------
    InputError
        If a number is NaN or infinite, naming its key.
    """
    try:
        text = json.dumps(values, indent=indent, allow_nan=False, ensure_ascii=False, default=_of_numpy)
    except ValueError:
        check_finite(values, name)
        raise
    # A file's name need not be text: what is not comes as the replacement character.
    text = text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    return json.dumps(json.loads(text), indent=indent) if ascii_only else text


def _of_numpy(value: Any) -> Any:
    """Python's form of a number or an array of numpy."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no form in JSON")


def check_finite(values: Any, name: str) -> None:
    """Refuse a result that is none.

    Raises
    ------
    InputError
        If a number is NaN or infinite, naming its key.
    """
    for place, number in _not_finite(values, ""):
        raise InputError(f"{name}: '{place}' comes out as {number}, which is no result; {FAR_OFF}")


def finite_json(values: Any) -> Any:
    """Values with numpy's scalars and arrays as Python's, tuples as lists, and NaN, no value, as None.

    Raises
    ------
    InputError
        If a number is infinite, naming its key.
    """
    plain = _plain(values)
    check_finite(plain, "result")
    return plain


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and math.isnan(value):
        return None
    return value


def _not_finite(value: Any, place: str) -> Iterator[tuple[str, float]]:
    """Keys of numbers that are not finite, in order: ``test[0].after.rms``."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _not_finite(item, f"{place}.{key}" if place else str(key))
    elif isinstance(value, list | tuple):
        for number, item in enumerate(value):
            yield from _not_finite(item, f"{place}[{number}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield place, value
