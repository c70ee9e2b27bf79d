"""A first import profile for a file that nobody has described: guesses with reasons, to be corrected."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from fogml.errors import quoted
from fogml.escaping import visible
from fogml.numerals import duration
from fogml.runs.columns import column_spec, conversion, converted, is_accepted
from fogml.runs.draft_container import container_fields
from fogml.runs.draft_layout import Field, as_yaml, text_layout
from fogml.runs.draft_words import AXIS, COUNT, DATE, GYRO, MULTIPLE, NO_OUTPUT, OWN, SET_POINT, TIME, WARM
from fogml.runs.header_spelling import face_of
from fogml.runs.opening import opened
from fogml.runs.possible import digits_of_clock
from fogml.runs.stamp_forms import stamp_form
from fogml.runs.stamps import PARTS, part_of_a_second, stamps_of_parts

_UNIT_IN_NAME = (("us", r"us\b|µs|micro"), ("ns", r"ns\b|nano"), ("ms", r"ms\b|milli"))
_UNITS = {unit: conversion("time", unit, "")[0] for unit in ("s", "ms", "us", "ns")}
_CENTURIES_S = 1e10  # three; what is counted from 1970 is 2e9
_FEW_VALUES = 20  # of 200: a state, a flag; the noise of a gyro takes more
_DAYS = ((30_000.0, 80_000.0), (724_000.0, 774_000.0))  # since 1900 or year 0, of the years 1982 to 2119
_LEAST_STEP = 1e-3  # no recording of so short steps [s] begins at so large a time; as days they are a minute
_KELVIN = 200.0  # no chamber is so hot in degC, and none so cold in kelvin
_MARK = "# GUESS: "


def draft_profile(path: Path) -> str:
    """The text of an import profile (YAML) for a file: what is sure, and what is a guess and why."""
    file = opened(path)
    tables: list[list[Field]] = []
    if file.kind == "csv":
        layout, fields, interval = text_layout(file.path)
    else:
        layout, fields, tables, interval = container_fields(path, file.kind)
    if file.within is not None:
        for one in fields:
            # Without its values another column would be taken for what it is.
            file.within.check_column(one.name, sum(bool(text.strip()) for text in one.first), len(one.first))
    lines = ["schema: fogml.import/1", f"description: {as_yaml('draft for ' + path.name)}"]
    lines += [*layout, *_columns(fields, interval)]
    lines += _joined(path.suffix, tables, {line.split(":")[0].strip() for line in lines})
    # Names may hold marks that end a line of YAML.
    return "\n".join(map(visible, lines)) + "\n"


def _columns(fields: Sequence[Field], interval: tuple[str, float] | None) -> list[str]:
    """The keys that say which field is which, given what the file says of the interval [s]."""
    left = list(fields)
    clock = _clock(left)
    lines = ["columns:", *clock]
    # One called so is it, though something be wrong with its values, which the import tells.
    gyros = _taken(left, lambda f: f.name == "gyro" or f.name.startswith("gyro_"))
    gyros = gyros or [f for f in left if f.name == "gyro"]
    gyros = gyros or _taken(left, _is_called_a_gyro)
    gyros.sort(key=lambda f: bool(NO_OUTPUT.search(f.name)))
    left = [f for f in left if f not in gyros]
    if not gyros:
        held = [f for f in left if np.isfinite(f.numbers).any() or not f.first]
        gyros = sorted(held, key=_unlike_a_gyro)[:1]
        left = [f for f in left if f not in gyros]
    axes = {m[1].lower(): f for f in gyros if (m := AXIS.search(f.name))}
    of_a_matrix = {m[1] for f in gyros if (m := re.fullmatch(r"(.*) column [123]", f.name))}
    in_order = "" if axes or len(gyros) != 3 or len(of_a_matrix) != 1 else f"    {_MARK}in this order?"
    axes = dict(zip("xyz", gyros, strict=True)) if in_order else axes
    many = len(gyros) > 1 and len(axes) == len(gyros)
    lines.append("  gyro: " + _gyro(gyros[0] if gyros else None, many))
    if gyros[1:] and not many:
        lines[-1] = _doubted(lines[-1], f"or {', '.join(as_yaml(f.source) for f in gyros[1:])}?")
    used: set[str] = set()
    warm_before = len(lines)
    of_a_run = _taken(left, lambda f: _is_of_a_run(f) and not (clock and f.name == "time"))
    faces = [face_of(one.name) for one in of_a_run]
    for one, face in zip(of_a_run, faces if "T_in" in faces else [None] * len(faces), strict=True):
        lines.append(_other(one, face, used))
        if beside := [f for f in left if f.name == "time" and _is_left_of(f, one)]:
            doubt = (
                f"by the clock of column {beside[-1].source}? then write it as a file of its own and join it"
            )
            lines[-1] = _doubted(lines[-1], doubt)
    if len(lines) == warm_before and (
        rest := sorted((f for f in left if np.isfinite(f.numbers).any()), key=_takes_few)
    ):
        lines.append(f"  # T: {{source: {as_yaml(rest[0].source)}, unit: degC}}    # a drift model needs one")
    if many:
        lines.append(
            "axes: {" + ", ".join(f"{axis}: {as_yaml(f.source)}" for axis, f in axes.items()) + "}" + in_order
        )
    if not any(line.startswith("  time:") for line in lines):
        held = [f for f in left if f.first and (f.name == "time" or TIME.search(f.name))]
        unread = f" ({quoted(held[0].first[0].strip())} is no date that is read)" if held else ""
        by = "write the true interval [s]" if interval is None else f"by {visible(interval[0])}"
        lines.append(
            f"sample_s: {interval[1] if interval else 0.01:.12g}    {_MARK}no clock was found{unread}; {by}"
        )
    others = [*left, *([] if many else gyros[1:])]
    rest = [f for f in others if isinstance(f.source, str) and (np.isfinite(f.numbers).any() or not f.first)]
    if rest:
        lines.append(
            f"# keep: [{', '.join(as_yaml(f.source) for f in rest)}]    # other columns, under their names"
        )
    lines += [
        "# facts: {unit: FOG-0417, latitude: 39.9, input_axis: up}",
        "# where: [{source: STATE, equals: 2}]        # rows to keep",
        "# legs: {up: {from_s: 0, to_s: 3600}}        # runs of their own",
    ]
    return lines


def _doubted(line: str, doubt: str) -> str:
    """A line with one more reason why it is a guess."""
    return f"{line}; {doubt}" if _MARK in line else f"{line}    {_MARK}{doubt}"


def _entry(line: str, one: Field) -> str:
    """The line of a field, a guess where the field's name says that its numbers are multiplied."""
    found = MULTIPLE.search(one.name)
    return _doubted(line, f"its name says {found[0].strip()}: state a scale") if found else line


def _is_called_a_gyro(one: Field) -> bool:
    """Whether a field's name is one of a gyro, and of nothing else that a run holds."""
    return bool(GYRO.search(one.name)) and not DATE.search(one.name) and column_spec(one.name) is None


def _joined(suffix: str, tables: Sequence[Sequence[Field]], used: set[str]) -> list[str]:
    """The keys that join thermometers of a container which have a clock of their own."""
    lines = []
    for table in tables:
        named = [
            f for f in table if f.name == "time" or (re.match("t_|time", f.name, re.IGNORECASE) and _grows(f))
        ]
        rest = [f for f in table if f not in named[:1] and _is_of_a_run(f) and f.name not in ("time", "gyro")]
        if named and rest:
            named[0].name = "time"
            lines += [
                f'  - file: "{{stem}}{suffix}"    # of this file, what has a clock of its own',
                "    columns:",
            ]
            lines += [f"    {line}" for line in [*_clock(named[:1]), *(_other(f, None, used) for f in rest)]]
    return ["join:", *lines] if lines else []


def _is_left_of(one: Field, other: Field) -> bool:
    """Whether a column stands before another one, where they are told by their places."""
    places = one.source, other.source
    return isinstance(places[0], int) and isinstance(places[1], int) and places[0] < places[1]


def _unlike_a_gyro(one: Field) -> tuple[bool, bool, bool, bool, int]:
    """What speaks against a field: a thermometer's name, a row's number, another unit, few values, text."""
    is_warm, other = bool(WARM.search(one.name)), one.unit is not None and not is_accepted("gyro", one.unit)
    is_number = _grows(one) and bool(COUNT.search(one.name))
    return is_warm, is_number, other, _takes_few(one), int(np.isnan(one.numbers).sum())


def _takes_few(one: Field) -> bool:
    """Whether a field takes few values, as a state does, or none that is a number."""
    return len(set(one.numbers[np.isfinite(one.numbers)].tolist())) < _FEW_VALUES


def _is_of_a_run(one: Field) -> bool:
    """Whether a field is a column of the run format, or a temperature by name or unit."""
    accepted = [
        name for name in ("T", "time", "gyro") if one.unit is not None and is_accepted(name, one.unit)
    ]
    is_warm = "T" in accepted or (not accepted and bool(WARM.search(one.name)))
    return column_spec(one.name) is not None or (is_warm and not SET_POINT.search(one.name))


def _clock(left: list[Field]) -> list[str]:
    """The clock's line: stamps, else a column that only grows and is named as one."""
    stamped = [(f, form.kind) for f in left if f.first and (form := stamp_form([f.first[0].strip()]))]
    if not stamped and (of_a_date := _parts_of_a_clock(left)):
        left[:] = [f for f in left if all(f is not one for one in of_a_date)]
        sources = [as_yaml(one.source) for one in of_a_date]
        return [f"  time: {{source: [{', '.join(sources)}], unit: stamp}}"]
    # What stands still is no time of day.
    stamped.sort(key=lambda one: len(set(one[0].first)) == 1)
    if stamped:
        left[:] = [f for f in left if all(f is not one for one, _ in stamped)]
        whole = [f for f, kind in stamped if kind.startswith("date and")]
        parts = [[f for f, kind in stamped if (kind == "date") is is_date][:1] for is_date in (True, False)]
        used = whole[:1] or [f for part in parts for f in part]
        used += _taken(left, lambda f: part_of_a_second(f.name, f.first) is not None)[:1]
        shown = [as_yaml(f.source) for f in used]
        timed = [f for f in left if _grows(f) and f.unit is not None and is_accepted("time", f.unit)]
        others = ", ".join(as_yaml(f.source) for f in (*(f for f, _ in stamped), *timed) if f not in used)
        source = shown[0] if len(shown) == 1 else f"[{', '.join(shown)}]"
        doubt = f"    {_MARK}or by {others}?" if others else ""
        return [f"  time: {{source: {source}, unit: stamp}}{doubt}"]
    # Other columns of the run format, such as a T that grows, are no clocks.
    free = [f for f in left if f.name == "time" or column_spec(f.name) is None]
    named = [f for f in free if f.name == "time" or TIME.search(f.name) or DATE.search(f.name)]
    growers = [f for f in free if _grows(f) and not COUNT.search(f.name) and not _is_of_a_run(f)]
    known = sorted(named, key=lambda f: f.name != "time") or growers[:1]
    growing = [f for f in known if _grows(f) or not f.first]
    growing = growing or [f for f in known if f.unit is not None and is_accepted("time", f.unit)]
    if not growing:
        return []
    one = growing[0]
    left.remove(one)
    if one.first and _is_in_digits(one):
        return [f"  time: {{source: {as_yaml(one.source)}, unit: stamp}}    {_MARK}HHMMSS, or plain numbers?"]
    if one.unit is not None and is_accepted("time", one.unit):
        line = _entry(f"  time: {{source: {as_yaml(one.source)}, unit: {as_yaml(one.unit)}}}", one)
        timed = [f for f in left if _grows(f) and f.unit is not None and is_accepted("time", f.unit)]
        rest = [as_yaml(f.source) for f in timed if f.name != one.name]
        return [_doubted(line, f"or by {', '.join(rest)}?") if rest else line]
    middle = np.median(one.numbers) if one.first else np.nan
    apart = np.median(np.diff(one.numbers)) if len(one.first) > 1 else np.nan
    is_date = DATE.search(f"{one.source} {one.name}") or apart < _LEAST_STEP
    if is_date and any(low < middle < high for low, high in _DAYS):
        why = "days, as a spreadsheet counts them, or datenum"
        return [f"  time: {{source: {as_yaml(one.source)}, unit: d}}    {_MARK}{why}"]
    # No clock of a laboratory shows centuries.
    possible = [u for u, scale in _UNITS.items() if not middle * scale > _CENTURIES_S] or ["s"]
    unit = next((u for u, hint in _UNIT_IN_NAME if re.search(hint, one.name, re.IGNORECASE)), possible[0])
    step = ""
    if len(one.first) > 1:
        ms = f", or {duration(apart / 1000.0)} if they are ms" if unit == "s" and apart > 1.0 else ""
        lasts = duration(apart * _UNITS[unit])
        step = f"steps of {apart:.6g}{f': {lasts}{ms}' if ms or unit != 's' else ''}; "
    line = f"  time: {{source: {as_yaml(one.source)}, unit: {unit}}}    {_MARK}{step}is the unit right?"
    return [_entry(line, one)]


def _is_in_digits(one: Field) -> bool:
    """Whether a field holds times such as 095959: no number has a zero before it, and minutes end."""
    found = [re.match(r"(\d{1,2})([0-5]\d)([0-5]\d)(?:\D|\Z)", text.strip(' "')) for text in one.first]
    is_padded = any(m is not None and len(m[1]) == 2 and m[1].startswith("0") for m in found)
    return all(found) and (is_padded or (_grows(one) and digits_of_clock(one.numbers)))


def _parts_of_a_clock(fields: Sequence[Field]) -> Sequence[Field]:
    """Six neighbouring fields that are year, month, day, hour, minute and second in every row, else none."""
    for start in range(len(fields) - PARTS + 1):
        found = fields[start : start + PARTS]
        texts = [[cell.strip(' "') for cell in one.first] for one in found]
        if texts[0] and all(stamps_of_parts(texts)):
            return found
    return ()


def _grows(one: Field) -> bool:
    """Whether a field's numbers only grow, to the last of them: a shorter log beside may end before."""
    known = np.flatnonzero(np.isfinite(one.numbers))
    values = one.numbers[: known[-1] + 1] if len(known) else np.empty(0)
    return len(values) > 1 and bool(np.all(np.diff(values) > 0.0))


def _gyro(one: Field | None, many: bool) -> str:
    """The gyro's entry."""
    if one is None:
        return f"{{source: GYRO, unit: deg/h}}    {_MARK}no column looks like a gyro; name it"
    source = "" if many else f"source: {as_yaml(one.source)}, "
    if one.unit is not None and is_accepted("gyro", one.unit):
        return _entry(f"{{{source}unit: {as_yaml(one.unit)}}}", one)
    values = one.numbers
    degree = r"(?:deg|[°º˚])(?:_?p(?:er)?)?[/_ ]?"
    hints = (
        ("deg/h", f"dph|{degree}h|grad/h"),
        ("deg/s", f"dps|{degree}s|grad/s"),
        # So ROS names what it gives in rad/s.
        ("rad/s", r"(?<!g)rad|angular_velocity"),
    )
    text = f"{one.name} {one.unit or ''}".lower()
    unit = next((u for u, hint in hints if re.search(hint, text)), None)
    angle = one.unit or one.name.rpartition("_")[2]
    if unit is None and (per := converted(angle, "deg")) is not None:
        why = f"{angle} turned in a sample? Then 'scale: {per[0]:.9g}/DT', DT its interval in seconds"
    elif unit is None and len(values) and np.all(values == np.round(values)):
        unit, why = "count", "whole numbers; with 'scale: 1/K' it may be deg/s or deg/h"
    else:
        why = f"the file says '{one.unit}': state a scale" if one.unit else "the file states no unit"
    return _entry(f"{{{source}unit: {unit or 'deg/s'}}}    {_MARK}{why}", one)


def _other(one: Field, face: str | None, used: set[str]) -> str:
    """The entry of a temperature, perhaps of a face of the coil, or another column of the run format."""
    others = ["T", *(f"T{i}" for i in range(1, 99))]
    named = [name for name in (one.name, face) if name is not None and column_spec(name) is not None]
    name = next(n for n in [*named, *others] if n not in used)
    guessed = "of the coil's face? else T_case or T_chamber" if name == face != one.name else None
    if name not in named and (name != "T" or not OWN.search(one.name)):
        where = "the gyro's own" if name == "T" else "a sensor of the coil"
        guessed = f"{where}? else T_case, T_chamber or another name"
    used.add(name)
    spec = column_spec(name)
    assert spec is not None
    if one.unit is not None and is_accepted(name, one.unit):
        doubt = f"    {_MARK}{guessed}" if guessed else ""
        return _entry(f"  {name}: {{source: {as_yaml(one.source)}, unit: {as_yaml(one.unit)}}}{doubt}", one)
    values = one.numbers
    warm = float(np.nanmedian(values)) if np.isfinite(values).any() else 0.0
    unit = "K" if spec.internal == "degC" and warm > _KELVIN else spec.internal
    entry = f"  {name}: {{source: {as_yaml(one.source)}, unit: {unit}}}"
    doubt = f", the file says '{one.unit}': state a scale" if one.unit else ", and is the unit right?"
    return _entry(f"{entry}    {_MARK}which sensor{doubt}", one)


def _taken(left: list[Field], is_one: Callable[[Field], bool]) -> list[Field]:
    """The fields of which something is true, taken from those that are left."""
    found = [f for f in left if is_one(f) and (np.isfinite(f.numbers).any() or not f.first)]
    for one in found:
        left.remove(one)
    return found
