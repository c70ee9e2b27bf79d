"""The fields of a logger's lines of text, as numbers or texts."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.runs.logger_lines import single_blanks
from fogml.runs.profile_parts import TextLayout

HIDDEN = "\x1a"
"""Stands for a separator within quotation marks while a line's fields are told apart."""
_QUOTED = re.compile(rb'"[^"\n]*"')


def hide_quoted(content: bytes, separator: str | None) -> bytes:
    """Lines whose separators within quotation marks are hidden, where one character separates."""
    if separator is None or b'"' not in content:
        return content
    mark = separator.encode()
    return _QUOTED.sub(lambda found: found[0].replace(mark, HIDDEN.encode()), content)


def shown(text: str, separator: str | None) -> str:
    """A text of hidden separators as it stands in the file."""
    return text if separator is None else text.replace(HIDDEN, separator)


def field_texts(content: bytes, profile: TextLayout, fields: int, position: int) -> NDArray[np.str_]:
    """A source column as texts without blanks and quotation marks about them, shape (rows,)."""
    import pyarrow as pa

    (column,) = _fields(content, profile, fields, [position], pa.string(), []).columns
    texts = np.char.strip(np.array(column.to_pylist(), dtype=np.str_), ' \t"')
    mark = profile.text_separator
    return texts if mark is None or b'"' not in content else np.char.replace(texts, HIDDEN, mark)


def _fields(
    content: bytes, profile: TextLayout, fields: int, positions: list[int], kind: Any, nulls: list[str] | None
) -> Any:
    """Fields by position, as Arrow reads them."""
    import pyarrow as pa
    from pyarrow import csv

    separator = profile.text_separator
    if separator is None:
        content, separator = single_blanks(content), " "
    names = [str(position) for position in range(fields)]
    wanted = [names[position] for position in positions]
    return csv.read_csv(
        pa.BufferReader(content),
        csv.ReadOptions(column_names=names),
        # A mark that is not closed must not swallow the lines below it.
        csv.ParseOptions(delimiter=separator, quote_char=False, ignore_empty_lines=False),
        csv.ConvertOptions(
            column_types=dict.fromkeys(wanted, kind),
            include_columns=sorted(set(wanted)),
            decimal_point=profile.decimal,
            null_values=nulls,
            strings_can_be_null=nulls is not None,
        ),
    )


def field_numbers(
    content: bytes, profile: TextLayout, fields: int, positions: list[int]
) -> NDArray[np.float64]:
    """The source columns as numbers, shape (columns, rows); NaN where there is none."""
    import pyarrow as pa

    if not positions:
        return np.empty((0, content.count(b"\n")))
    wanted = [str(position) for position in positions]
    try:
        columns = _fields(content, profile, fields, positions, pa.float64(), None)
    except pa.ArrowInvalid:
        # Some field is no plain number: read text, and let what is none become NaN.
        text = _fields(content, profile, fields, positions, pa.string(), [""])
        numbers = [_numbers(text[name], profile.decimal) for name in text.column_names]
        columns = pa.table(numbers, names=text.column_names)
    return np.stack([columns[name].to_numpy() for name in wanted])


def _numbers(text: Any, decimal: str) -> Any:
    """Text as float64, null where it is no number."""
    import pyarrow as pa
    import pyarrow.compute as compute

    plain = compute.replace_substring_regex(compute.utf8_trim_whitespace(text), r'^"(.*)"$', r"\1")
    plain = compute.utf8_trim_whitespace(plain)
    # The decimal mark is stated, so that another one before three digits is one of thousands.
    marks = f"[{'.' if decimal == ',' else ','}'{HIDDEN}\u00a0\u202f]"
    groups = rf"^[-+]?[1-9]\d{{0,2}}({marks}\d{{3}})+({re.escape(decimal)}\d*)?$"
    bare = compute.replace_substring_regex(plain, marks, "")
    plain = compute.if_else(compute.match_substring_regex(plain, groups), bare, plain)
    if decimal == ",":
        plain = compute.replace_substring(compute.replace_substring(plain, ".", HIDDEN), ",", ".")
    plain = compute.replace_substring_regex(plain, r"^\+", "")
    valid = compute.match_substring_regex(plain, r"^-?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$")
    return compute.cast(compute.if_else(valid, plain, pa.scalar(None, pa.string())), pa.float64())
