"""What the picture of an effect is drawn on: a programme, an attitude and the samples that show it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from fogml.runs.facts import Facts
from fogml.twin.programme import Programme, load_programme, programme_names

_POINTS = 2000
_LEAST_S = 0.5
_LATITUDE = 39.9


def _facts(**stated: Any) -> Facts:
    return Facts(axis="x", latitude=_LATITUDE, **stated)


UPRIGHT, HORIZONTAL = _facts(input_axis="up"), _facts(input_axis="north")
TUMBLING = _facts(input_axis="up", table_axis="east")


@dataclass(frozen=True)
class Scene:
    """A programme and how a picture of it is taken.

    Attributes
    ----------
    name
        What the picture is called.
    steps
        The programme, where it is none that ships.
    facts
        Attitude.
    sample_s
        Sample interval [s]; if None, what makes some 2000 samples.
    from_share
        Share of the programme that goes by before the picture begins.
    shape
        Shape parameters of the effect that are not the usual ones.
    """

    name: str
    steps: Mapping[str, Any] | None = None
    facts: Facts = UPRIGHT
    sample_s: float | None = None
    from_share: float = 0.0
    shape: Mapping[str, float] = field(default_factory=dict)

    @property
    def programme(self) -> Programme:
        """The programme."""
        return load_programme(self.name if self.steps is None else self.steps).named(self.name)

    @property
    def interval_s(self) -> float:
        """Sample interval [s]."""
        return self.sample_s or max(_LEAST_S, float(math.ceil(self.programme.total_s / _POINTS)))


_SCENES = (
    Scene("rest for an hour", {"steps": ["soak at 25 degC for 1 h"]}),
    Scene(
        "a turn of the table and back in two hours",
        {
            "steps": [
                {"soak at 25 degC for 1 h": ["turn at 0.1 deg/s for 1 h"]},
                {"hold for 1 h": ["turn at -0.1 deg/s for 1 h"]},
            ]
        },
    ),
    Scene(
        "a turn about a horizontal axis in an hour",
        {"steps": [{"soak at 25 degC for 1 h": ["turn at 0.1 deg/s for 1 h"]}]},
        TUMBLING,
    ),
    Scene(
        "turns of half a minute",
        {
            "steps": [
                {
                    "soak at 25 degC for 3 min": [
                        "turn at 10 deg/s for 30 s, then 0 deg/s for 30 s, then -10 deg/s for 30 s, "
                        "from minute 0.5"
                    ]
                }
            ]
        },
        sample_s=0.5,
    ),
    Scene(
        "turns at 400 deg/s",
        {
            "steps": [
                {
                    "soak at 25 degC for 2 min": [
                        "turn at 400 deg/s for 40 s, then -400 deg/s for 40 s, from second 10"
                    ]
                }
            ]
        },
        sample_s=0.5,
    ),
    Scene(
        "a step of the rate within a millisecond",
        {
            "table_acceleration": "100000 deg/s2",
            "start_temperature": "45 degC",
            "steps": [{"soak at 45 degC for 0.06 s": ["turn at 100 deg/s for 0.03 s from second 0.01"]}],
        },
        sample_s=5e-5,
    ),
    Scene(
        "thermal shocks of 60 degC/min with a threshold of 3 degC/min",
        {
            "fastest_rate": "60 degC/min",
            "start_temperature": "-55 degC",
            "steps": [
                "hold for 15 min",
                "ramp to 85 degC at 60 degC/min",
                "soak at 85 degC for 75 min",
                "ramp to -55 degC at 60 degC/min",
                "soak at -55 degC for 75 min",
            ],
        },
        shape={"threshold": 3.0},
    ),
    Scene(
        "irradiation for two hours, turning at 10 deg/s",
        {
            "steps": [
                {
                    "soak at 25 degC for 30 h": [
                        "radiation at 20 Gy/h for 2 h from hour 2",
                        "turn at 10 deg/s for 30 h",
                    ]
                }
            ]
        },
    ),
    Scene(
        "the end of a ramp of 10 degC/h",
        {"steps": ["ramp to 35 degC at 0.16666666666666666 degC/min"]},
        sample_s=0.5,
        from_share=0.9,
    ),
)
SCENES: dict[str, Scene] = {scene.name: scene for scene in _SCENES}
"""Set-ups made for pictures, by name."""


def scene(name: str) -> Scene:
    """The scene of a name: of `SCENES`, or a programme that ships."""
    if name in SCENES:
        return SCENES[name]
    return Scene(name, facts=HORIZONTAL if name == "four-positions" else UPRIGHT)


def scene_names() -> tuple[str, ...]:
    """All that an effect may be shown on."""
    return (*SCENES, *programme_names())
