"""Results as JSON: one writer, which takes no number that is not finite."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fogml.errors import InputError

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
        Mappings, lists, texts, numbers.
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
        text = json.dumps(values, indent=indent, allow_nan=False, ensure_ascii=False)
    except ValueError:
        check_finite(values, name)
        raise
    # A file's name need not be text: what is not comes as the replacement character.
    text = text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    return json.dumps(json.loads(text), indent=indent) if ascii_only else text


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
