"""Plain sentences of a programme: "soak at -40 degC for 1 h", "fan off for 10 min from minute 5".

Steps::

    soak at TEMPERATURE for TIME        hold for TIME
    ramp to TEMPERATURE at RATE         repeat N times

Actions within a step, at times counted from its beginning::

    turn at RATE [for TIME] [, then RATE for TIME]... [, from minute M]
    turn to ANGLE at RATE [from minute M]         turn by ANGLE at RATE [from minute M]
    oscillate at RATE and FREQUENCY for TIME [from minute M]
    power | fan | compressor | heater   on | off | at N % | automatic   [for TIME] [from minute M]
    humidity N % | automatic [for TIME] [from minute M]
    radiation at N Gy/h | off [for TIME] [from minute M]
    yaw to ANGLE [for TIME] [at minute M]

A moment is "minute 20", "hour 1", "second 30" or a time such as "1 h 30 min"; "from", "at" and
"after" say the same.
"""

from __future__ import annotations

from fogml.errors import InputError
from fogml.twin.sentence_reader import SentenceReader
from fogml.twin.steps import (
    AUTOMATIC,
    SWITCHED,
    Action,
    Hold,
    Oscillate,
    Ramp,
    Repeat,
    Setting,
    Soak,
    Step,
    Switched,
    Turn,
    TurnTo,
)

_STEP_WORDS = ("soak", "hold", "ramp", "repeat")
_MOTIONS = ("turn", "oscillate")


def parse_step(text: str) -> Soak | Hold | Ramp | Repeat:
    """The step that a sentence stands for, without actions; a `Repeat` without steps.

    Raises
    ------
    InputError
        Pointing at what was not understood.
    """
    reader = SentenceReader(text)
    misplaced = None
    if reader.peek() in (*_MOTIONS, *SWITCHED):
        misplaced = f"'{reader.peek()}' is an action: list it under the step in which it happens"
    word = reader.one_of(_STEP_WORDS, misplaced)
    step: Step
    if word == "soak":
        reader.expect("at")
        temperature = reader.temperature()
        reader.expect("for")
        step = Soak(temperature, reader.duration())
    elif word == "hold":
        reader.expect("for")
        step = Hold(reader.duration())
    elif word == "ramp":
        reader.expect("to")
        temperature = reader.temperature()
        reader.expect("at")
        at = reader.place
        rate = reader.quantity("temperature rate")
        if not rate > 0.0:
            reader.fail("a rate is stated above 0; the target says whether it goes up or down", at)
        step = Ramp(temperature, rate)
    else:
        step = Repeat(reader.count(), ())
        reader.expect("times", "time")
    reader.end()
    return step


def parse_action(text: str) -> Action:
    """The action that a sentence stands for.

    Raises
    ------
    InputError
        Pointing at what was not understood.
    """
    reader = SentenceReader(text)
    misplaced = None
    if reader.peek() in _STEP_WORDS:
        misplaced = f"'{reader.peek()}' is a step: it can't stand under another one"
    word = reader.one_of((*_MOTIONS, *SWITCHED), misplaced)
    action: Action
    if word == "turn":
        action = _turn(reader)
    elif word == "oscillate":
        action = _oscillate(reader)
    else:
        (what,) = (name for name in SWITCHED if name == word)
        action = _setting(reader, what)
    reader.end()
    return action


def parse_quantity(text: str, dimension: str) -> float:
    """A number with its unit such as ``5 degC/min``; dimensions are those of the messages.

    Raises
    ------
    InputError
        Pointing at what was not understood.
    """
    reader = SentenceReader(text)
    value = reader.temperature() if dimension == "temperature" else reader.quantity(dimension)
    reader.end()
    return value


def _turn(reader: SentenceReader) -> Turn | TurnTo:
    way = reader.one_of(("at", "to", "by"))
    if way != "at":
        angle = reader.quantity("angle")
        reader.expect("at")
        place = reader.place
        rate = reader.quantity("table rate")
        if not rate > 0.0:
            reader.fail("the rate on the way to an angle is stated above 0", place)
        return TurnTo(angle, rate, reader.moment(), relative=way == "by")
    segments: list[tuple[float, float | None]] = []
    while True:
        rate = reader.quantity("table rate")
        lasting = reader.duration() if reader.take("for") else None
        segments.append((rate, lasting))
        if not reader.take("then"):
            break
        if lasting is None:
            reader.fail("only the last rate may do without 'for TIME'")
        reader.take("at")
    return Turn(tuple(segments), reader.moment())


def _oscillate(reader: SentenceReader) -> Oscillate:
    reader.expect("at")
    place = reader.place
    rate = reader.quantity("table rate")
    reader.expect("and")
    frequency = reader.quantity("frequency")
    reader.expect("for")
    lasting = reader.duration()
    start = reader.moment()
    try:
        return Oscillate(rate, frequency, lasting, start)
    except InputError as error:
        reader.fail(str(error), place)


def _setting(reader: SentenceReader, what: Switched) -> Setting:
    value: float | None
    place = reader.place
    if what == "yaw":
        reader.expect("to")
        value = reader.quantity("angle")
    elif what in AUTOMATIC and reader.take("automatic"):
        value = None
    elif what == "humidity":
        reader.take("at")
        place = reader.place
        value = reader.quantity("humidity")
        if not 0.0 <= value <= 100.0:
            reader.fail("humidity lies between 0 and 100 %", place)
    elif what == "radiation":
        off = reader.one_of(("at", "off")) == "off"
        place = reader.place
        value = 0.0 if off else reader.quantity("dose rate")
        if value < 0.0:
            reader.fail("a dose rate is not negative", place)
    else:
        words = ("on", "off", *(("at",) if what != "power" else ()))
        word = reader.one_of((*words, "automatic") if what in AUTOMATIC else words)
        place = reader.place
        value = reader.quantity("duty") if word == "at" else float(word == "on")
        if not 0.0 <= value <= 1.0:
            reader.fail("a duty lies between 0 and 100 %", place)
    lasting = reader.duration() if reader.take("for") else None
    return Setting(what, value, reader.moment(), lasting)
