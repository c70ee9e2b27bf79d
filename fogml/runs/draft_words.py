"""Words in names of columns by which a draft guesses what they are."""

from __future__ import annotations

import re

TIME = re.compile(r"time|stamp|clock|zeit|epoch|tick|^t$|^ts$|^[mun]?s(ec)?$|sow|tow|时间", re.IGNORECASE)
COUNT = re.compile(
    r"#|sample|index|count|packet|seq|row|scan|record|^id$|^rn$|^n(o|r)?\.?$|^i$|序号", re.IGNORECASE
)
DATE = re.compile(r"date|datum|日期", re.IGNORECASE)
GYRO = re.compile(r"gyr|fog|omega|^om|ang.*(vel|rate)|^w[_.]?[xyz]?$|^g[_.]?[xyz]$|rate|陀螺", re.IGNORECASE)
WARM = re.compile(r"temp|die|oven|therm|^t(\w{0,3}|[_.]\w*)$|温", re.IGNORECASE)
SET_POINT = re.compile(r"\bs[pv]\b|soll|set[ _-]?(point|value|temp)|target|consigne|设定", re.IGNORECASE)
OWN = re.compile(r"die|coil|gyr|fog|sensor|imu|spule|kreisel|^t(emp\w*)?$|陀螺|线圈|光纤", re.IGNORECASE)
"""Of a thermometer's name that puts it in the gyro, or nowhere."""
NO_OUTPUT = re.compile(r"std|dev|sigma|rms|var|noise|err|min|max|cmd|command|table|turntable", re.IGNORECASE)
"""Of a gyro's name that tells of something about its output, or of another's rate."""
MULTIPLE = re.compile(
    r"[x*×·]\s?10+\b|/\s?10+\b|(?<![a-z\d.])(?:1?e-?\d|10\^-?\d|0\.0*1)(?!\d)", re.IGNORECASE
)
"""What a name or unit says of numbers that are multiplied: x100, 1e-3, 0.1."""
AXIS = re.compile(r"([xyz])\W*\Z", re.IGNORECASE)
