"""Header cells as laboratories write them, brought to ``name [unit]`` of the run format."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence

from fogml.runs.columns import (
    KNOWN,
    canonical_unit,
    coil_sensor_number,
    column_spec,
    is_accepted,
    is_unit,
    parse_header,
    signs,
)

DATE_NAMES = frozenset({"date", "datum", "日期"})
"""What a column of dates beside one of times of day is called."""
_OF_THE_GYRO = ("gyro", "fog", "coil", "sensor", "die", "imu")
_WARM = ("temp", "temperature", "temperatur")
_DATE_AND_TIME = (("date", "and", "time"), ("datum", "und", "zeit"), ("datum", "und", "uhrzeit"),
                  ("日期", "和", "时间"))  # fmt: skip
_SYNONYMS = {
    "time": ("t", "timestamp", "elapsed", "elapsedtime", "zeit", "uhrzeit", "zeitstempel", "时间",
             "时刻", "采样时间", "indexlevel0", "時刻", "時間", "время", "heure", "hora",
             *(d + mark + t for d, word, t in _DATE_AND_TIME for mark in ("", "/", ",", word))),
    "gyro": ("gyroscope", "gyrooutput", "gyrorate", "fog", "fogoutput", "fograte", "omega", "ω",
             "angularrate", "angularvelocity", "rotationrate", "drehrate", "kreisel",
             "kreiselausgang", "陀螺", "陀螺输出", "陀螺仪", "陀螺仪输出", "角速度", "角速率",
             "陀螺角速度", "陀螺角速率", "ジャイロ", "ジャイロ出力", "гироскоп"),
    "rate": ("tablerate", "turntablerate", "drehtischrate", "转台速率", "转台转速", "转台角速度",
             "转台角速率"),
    "T": ("temp", "temperature", "temperatur", "spulentemperatur", "температура", "温度", "线圈温度",
          "光纤环温度",
          *(name for of in _OF_THE_GYRO for name in (f"t{of}", *(of + word for word in _WARM)))),
    **{
        f"T_{of}": (*(of + word for word in _WARM), *words)
        for of, words in (
            ("chamber", ("kammertemperatur", "温箱温度", "箱温")),
            ("case", ("gehäusetemperatur", "壳体温度", "外壳温度")),
            ("electronics", ("elektroniktemperatur", "电路温度")),
        )
    },
}  # fmt: skip
_OF_A_FACE = {
    "T_in": re.compile(r"inn(?:en|ere?)|inside|内"),
    "T_out": re.compile(r"(?:au(?:ß|ss)en|(?:ä|ae)u(?:ß|ss)ere?)|out(?:er|side)|外"),
}
_OF_A_COIL = re.compile(r"fib(?:re|er)coil|coil|spulen?|光纤环|线圈")
_AROUND_A_FACE = re.compile(r"temp(?:eratur)?e?|温度?|face|seite|surface|侧|of|the|[._/]|t(?![a-z])")
_SPELLED = {re.sub(r"[\s_-]", "", name.lower()): name for name in KNOWN}
_MEANT = {re.sub(r"[\s_-]", "", word): name for name, words in _SYNONYMS.items() for word in words}
_OF_AN_AXIS = re.compile(r"(?:gyro?|gyroscope|omega|angular(?:rate|velocity)|[gw])([xyz])\Z")
_FORM_OF_TIMES = re.compile(
    r"(?=.*[:y])(?:[ymdhs]{1,4}|f{1,9})(?:[-/.:, t]+(?:[ymdhs]{1,4}|f{1,9}))+\Z", re.IGNORECASE
)
_PARENTHESES = str.maketrans("（）", "()")
_BLANKS = re.compile(r"\s{2,}")
_NUMBER = re.compile(r"[-+\d.,:' ]+\Z")
_COMMENT = re.compile(r"\s*(#|%|//)+\s*")
_FORMS = (
    re.compile(r"(?P<name>.*?)\s*\((?P<unit>[^()]*)\)\Z"),
    re.compile(r"(?P<name>.*?)\s*\[(?P<unit>[^][]*)\]\Z"),
    re.compile(r"(?P<name>[^/,]*?)\s*[/,]\s*\(?(?P<unit>[^()]*)\)?\Z"),
    re.compile(r"(?P<name>.*?)\s+(?:in\s+)?(?P<unit>\S+)\Z"),
    re.compile(r"(?P<name>.*?)_(?P<unit>[A-Za-z%]+(?:_(?:per_)?(?:h|s|hr|sec))?)\Z"),
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
    others = Counter(_meant(other) for other, _ in found if column_spec(other) is None)
    is_warm = others["T_in"] == 1 or any(
        (n in ("T", "T_in") or coil_sensor_number(n)) and is_accepted(n, u) for n, u in found
    )
    names = []
    for name, unit in found:
        meant = _meant(name)
        alone = others[meant] == 1
        is_free = meant not in taken and column_spec(name) is None
        sound = meant is not None and is_free and alone and is_accepted(meant, unit)
        if sound and not (meant == "T" and (is_warm or unit is None)):
            assert meant is not None
            names.append((meant, unit))
        else:
            names.append((name, unit))
    return tuple(f"{name} [{unit}]" if unit is not None else name for name, unit in names)


def face_of(name: str) -> str | None:
    """``T_in`` or ``T_out`` of a temperature that a name puts inside or outside, of whatever; else None.

    ``Temperatur außen`` may be of the coil's outer face, of the case or of the air: who wrote it knows.
    """
    plain = _OF_A_COIL.sub("", _plain(name))
    found = [face for face, words in _OF_A_FACE.items() if words.search(plain)]
    if len(found) != 1 or not re.search("temp|温|coil|spule|^t", _plain(name)):
        return None
    rest = _AROUND_A_FACE.sub("", _OF_A_FACE[found[0]].sub("", plain, count=1))
    return None if rest else found[0]


def column_meant(name: str) -> str | None:
    """The column of the run format that a name spells, or a word means, whatever its unit."""
    return _SPELLED.get(_plain(name)) or _meant(name)


def _meant(name: str) -> str | None:
    """The column of the run format that a word means; a face of the coil only where the coil is named."""
    plain = _plain(name)
    return _MEANT.get(plain) or (face_of(name) if _OF_A_COIL.search(plain) else None)


def with_units_below(cells: Sequence[str], row: Sequence[str]) -> tuple[str, ...] | None:
    """The cells with their units from the row below them; None where that is no row of units.

    It is one of spellings of units and form of times alone, or one of words that has accepted units below two
    columns of the run format.
    """
    below = [re.sub(r"\A[\[(](.*)[\])]\Z", r"\1", field.strip().strip('"')) for field in row]
    units = ["" if not f.strip("-_. ") or _FORM_OF_TIMES.match(f) else f for f in below]
    stated = [unit for unit in units if unit]
    if not stated or any(_NUMBER.match(unit) or set("[]") & set(unit) for unit in stated):
        return None
    units += [""] * (len(cells) - len(units))
    both = [(above, unit) for cell, unit in zip(cells, units) if unit and (above := parse_header(cell)[1])]
    if any(is_unit(above) and is_unit(unit) and above != canonical_unit(unit) for above, unit in both):
        return None
    taken = [bool(unit) and parse_header(cell)[1] is None for cell, unit in zip(cells, units)]
    below_it = zip(cells, units, taken, strict=False)
    found = canonical_cells([f"{cell} [{unit}]" if is_new else cell for cell, unit, is_new in below_it])
    told = [parse_header(cell) for cell, is_new in zip(found, taken, strict=True) if is_new]
    known = sum(unit is not None and is_accepted(_known_name(name), unit) for name, unit in told)
    return found if (all(map(is_unit, stated)) and len(row) >= len(cells)) or known > 1 else None


def _known_name(name: str) -> str:
    """The column of the run format of which a column of one axis is."""
    return re.sub(r"\A(gyro|rate)_[xyz]\Z", r"\1", name)


def _plain(name: str) -> str:
    return re.sub(r"[\s_.-]", "", signs(name).lower())


def _parts(cell: str) -> tuple[str, str | None]:
    """Name and unit of a cell; a name that is spelled as one of the run format's is brought to that."""
    cell = _BLANKS.sub(" ", cell)
    name, unit = parse_header(cell)
    if column_spec(name) is not None:
        return name, unit
    for text, of_it in _splits(signs(cell)):
        known = _known(text, of_it)
        if known is not None:
            return known, of_it
    for text, of_it in _splits(signs(cell)):
        if _meant(text) is not None and of_it is not None and is_unit(of_it):
            return text, of_it
    plain = cell.translate(_PARENTHESES)
    # A sign of degrees stands in no name.
    for form, sign in ((_FORMS[0], ""), (_FORMS[3], "°")):
        match = form.match(plain)
        if match and match["name"] and is_unit(match["unit"]) and sign in signs(match["unit"]):
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
            unit = re.sub("_(per_)?", "/", match["unit"])
            yield match["name"], canonical_unit(unit)
