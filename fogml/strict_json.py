"""JSON as every file of the toolkit is read: strict, bounded, each key once; and one hash over content."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from fogml.errors import InputError, printable, quoted

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
    """The bytes of a file of bounded size."""
    try:
        with path.open("rb") as file:
            data = file.read(most_bytes + 1)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; {remedy}") from None
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
        raise InputError(f"{source}: schema {quoted(found)}, expected '{schema}'; {remedy}")
    return value


def content_hash(document: Mapping[str, Any], files: Mapping[str, bytes] | None = None) -> str:
    """SHA-256 over a JSON-ready document, however it is laid out in a file, and over files beside it."""
    text = json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False)
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
