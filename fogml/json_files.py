"""Results as JSON: one writer, which takes no number that is not finite."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fogml.errors import InputError


def write_json(path: str | Path, values: Any, indent: int | None = 2) -> None:
    """Write values as a JSON file.

    Raises
    ------
    InputError
        If a number is NaN or infinite, naming its key.
    """
    path = Path(path)
    path.write_text(json_text(values, path.name, indent) + "\n", encoding="utf-8")


def json_text(values: Any, name: str, indent: int | None = None) -> str:
    """Values as the text of JSON.

    Parameters
    ----------
    values
        Mappings, lists, texts, numbers.
    name
        What they are called in a message.
    indent
        Spaces for each level; None for one line.

    Raises
    ------
    InputError
        If a number is NaN or infinite, naming its key.
    """
    try:
        return json.dumps(values, indent=indent, allow_nan=False, ensure_ascii=False)
    except ValueError:
        for place, number in _not_finite(values, ""):
            raise InputError(
                f"{name}: '{place}' comes out as {number}, which is no result; is a value in the input, or a "
                "setting, far too large or far too small?"
            ) from None
        raise


def finite_json(value: Any) -> Any:
    """The value with numpy's scalars and arrays as Python's, tuples as lists, and NaN, no value, as None.

    Infinities stay: `json_text` refuses them.
    """
    if isinstance(value, dict):
        return {str(key): finite_json(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite_json(item) for item in value]
    if hasattr(value, "tolist"):
        return finite_json(value.tolist())
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
