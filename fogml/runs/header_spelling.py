"""Header cells as laboratories write them, brought to ``name [unit]`` of the run format."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence

from fogml.runs.columns import KNOWN, coil_sensor_number, column_spec, is_accepted, parse_header
from fogml.runs.units import canonical_unit, is_unit, signs

DATE_NAMES = frozenset({"date", "datum", "日期"})
"""What a column of dates beside one of times of day is called."""
_SYNONYMS = {
    "time": ("t", "timestamp", "datetime", "date/time", "dateandtime", "elapsed", "elapsedtime", "zeit",
             "uhrzeit", "时间", "indexlevel0"),
    "gyro": ("gyroscope", "gyrooutput", "gyrorate", "fog", "fogoutput", "陀螺", "陀螺输出"),
    "T": ("temp", "temperature", "temperatur", "温度"),
}  # fmt: skip
_SPELLED = {re.sub(r"[\s_-]", "", name.lower()): name for name in KNOWN}
_MEANT = {re.sub(r"[\s_-]", "", word): name for name, words in _SYNONYMS.items() for word in words}
_OF_AN_AXIS = re.compile(r"(?:gyro?|gyroscope|omega|angular(?:rate|velocity)|[gw])([xyz])\Z")
_COMMENT = re.compile(r"\s*(#|%|//)+\s*")
_FORMS = (
    re.compile(r"(?P<name>.*?)\s*\((?P<unit>[^()]*)\)\Z"),
    re.compile(r"(?P<name>.*?)\s*\[(?P<unit>[^][]*)\]\Z"),
    re.compile(r"(?P<name>[^/,]*?)\s*[/,]\s*\(?(?P<unit>[^()]*)\)?\Z"),
    re.compile(r"(?P<name>.*?)\s+(?:in\s+)?(?P<unit>\S+)\Z"),
    re.compile(r"(?P<name>.*?)_(?P<unit>[A-Za-z%]+(?:_[hs])?)\Z"),
)


def uncommented(line: str) -> str:
    """A line without a comment mark before it."""
    mark = _COMMENT.match(line)
    return line[mark.end() :] if mark else line


def canonical_cells(cells: Sequence[str]) -> tuple[str, ...]:
    """Header cells with the names and units of the run format where they are spellings of these.

    A name is taken for one of the run format's only with a unit that this has, or with none at all. A word
    such as ``temperature`` counts as ``T`` where the columns give no ``T``: neither it, nor ``T_in``, nor
    sensors of the coil.
    """
    found = [_parts(cell) for cell in cells]
    taken = {name for name, _ in found if column_spec(name)}
    is_warm = any((n in ("T", "T_in") or coil_sensor_number(n)) and is_accepted(n, u) for n, u in found)
    others = Counter(_MEANT.get(_plain(other)) for other, _ in found if column_spec(other) is None)
    names = []
    for name, unit in found:
        meant = _MEANT.get(_plain(name))
        alone = others[meant] == 1
        sound = meant is not None and meant not in taken and alone and is_accepted(meant, unit)
        if sound and not (meant == "T" and (is_warm or unit is None)):
            assert meant is not None
            names.append((meant, unit))
        else:
            names.append((name, unit))
    return tuple(f"{name} [{unit}]" if unit is not None else name for name, unit in names)


def with_units_below(cells: Sequence[str], row: Sequence[str]) -> tuple[str, ...] | None:
    """The cells with their units from the row below them; None where that is no row of units."""
    below = [re.sub(r"\A[\[(](.*)[\])]\Z", r"\1", field.strip()) for field in row]
    stated = [field for field in below if field.strip("-_. ")]
    if not stated or len(row) < len(cells) or not all(is_unit(f) and not f.isdigit() for f in stated):
        return None
    return canonical_cells(
        [
            f"{cell} [{unit}]" if unit.strip("-_. ") and parse_header(cell)[1] is None else cell
            for cell, unit in zip(cells, below)
        ]
    )


def _plain(name: str) -> str:
    return re.sub(r"[\s_-]", "", signs(name).lower())


def _parts(cell: str) -> tuple[str, str | None]:
    """Name and unit of a cell; a name that is spelled as one of the run format's is brought to that."""
    name, unit = parse_header(cell)
    if column_spec(name) is not None:
        return name, unit
    for text, of_it in _splits(signs(cell)):
        known = _known(text, of_it)
        if known is not None:
            return known, of_it
    for text, of_it in _splits(signs(cell)):
        if _plain(text) in _MEANT and of_it is not None and is_unit(of_it):
            return text, of_it
    if (match := _FORMS[0].match(cell)) and match["name"] and is_unit(match["unit"]):
        return match["name"], canonical_unit(match["unit"])
    return name, unit


def _known(name: str, unit: str | None) -> str | None:
    """The column of the run format that a name spells, if it may have that unit."""
    plain = _plain(name)
    # One of several gyros: a name of it with its axis, and a unit of a rate.
    if (axis := _OF_AN_AXIS.match(plain)) and unit is not None and is_accepted("gyro", unit):
        return f"gyro_{axis[1]}"
    if plain == "t":
        names = ["T" if unit is not None and is_accepted("T", unit) else "time"] if unit else []
    else:
        names = [_SPELLED.get(plain, plain.upper())]
    return next((n for n in names if (n in KNOWN or coil_sensor_number(n)) and is_accepted(n, unit)), None)


def _splits(cell: str) -> Iterator[tuple[str, str | None]]:
    """What may be a name and its unit, the surest first."""
    yield cell, None
    for form in _FORMS:
        if match := form.match(cell):
            unit = match["unit"].replace("_", "/")
            yield match["name"], canonical_unit(unit)
