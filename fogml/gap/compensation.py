"""What of a cause a gyro can compensate by itself: its family as features of a drift model.

Features are text (the language of ``fogml train --features``), of what a unit knows in service: its sensors,
the time since power-on, what else it records. They are causal, where the diagnosis itself looks at smoothed
readings with hindsight. Each family states its span:

- any loop of half width w with a smooth density of relays is a function of the play of that half width
  (I. D. Mayergoyz, Mathematical Models of Hysteresis, 1991), so its powers hold a Preisach plane;
- a lag's rate is a rate with exponential memory;
- a period or a centre that lies between two of the diagnosis's grid is held by its neighbours.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fogml.gap import other_families as other
from fogml.gap import thermal_families as thermal
from fogml.gap.inference import Inference
from fogml.gap.posterior import Cause
from fogml.gap.result_parts import Compensable, Compensation
from fogml.gap.scene import Scene
from fogml.twin.effect import Effect

WINDOW_S = 64.0
"""Window of rates and differences, as in the nominal twin [s]; two samples where those are longer."""
LOOP_POWERS = 3
"""Powers of a play: densities of relays up to a parabola."""
NEIGHBOURS = (-0.2, 0.0, 0.2)
"""Waves that stand for one, apart in cycles over the range of temperature: half of the grid's step."""
Form = Mapping[str, Any]


@dataclass(frozen=True)
class Recorded:
    """What the runs record, for features."""

    columns: frozenset[str]
    window_s: float
    powered_on: bool
    span_degc: float

    @classmethod
    def by(cls, scene: Scene) -> Recorded:
        """What all runs of a scene record."""
        runs = [r.run for r in scene.runs]
        columns = frozenset.intersection(*(frozenset(run.columns) for run in runs))
        faces = all(run.sensors("T_in") and run.sensors("T_out") for run in runs)
        columns |= {"T_in", "T_out"} if faces else frozenset()
        on = all(run.facts.powered_on is not None for run in runs)
        longest = max(run.sample_s for run in runs)
        return cls(columns, max(WINDOW_S, 2.0 * longest), on, scene.span_degc)

    @property
    def faces(self) -> bool:
        """Whether both faces of the coil are told."""
        return {"T_in", "T_out"} <= self.columns

    def options(self, method: str = "block", length_s: float | None = None) -> str:
        """Options of a rate or a difference."""
        length_s = self.window_s if length_s is None else length_s
        return "" if (method, length_s) == ("block", WINDOW_S) else f"[{method}, {length_s:g} s]"

    def signal(self, place: str) -> tuple[str, float]:
        """Text of the temperature of a place that drives a cause, and how late it is behind that [s]."""
        late = re.search(r", ([0-9.]+) s late$", place)
        lag_s = float(late[1]) if late else 0.0
        name = place[: late.start()] if late else place
        stated = {"recorded electronics": "T_electronics", "chamber air": "T_chamber"}
        if stated.get(name) in self.columns:
            return stated[name], lag_s
        mixed = {"inner face": "T_in", "outer face": "T_out", "hub": "1.5*T_in-0.5*T_out"}
        if not self.faces:
            return "T", lag_s
        return mixed.get(name, "0.5*T_in+0.5*T_out"), lag_s

    def rate(self, signal: str, lag_s: float = 0.0) -> str:
        """Text of a signal's rate, behind a lag or not."""
        return f"d({signal}){self.options('exp', lag_s) if lag_s else self.options()}"


def constants_features(recorded: Recorded) -> tuple[str, ...]:
    """The nominal twin's bias as features: its slope and curvature, its gradient, its response to DeltaT."""
    gradient = ("T_in-T_out",) if recorded.faces else ()
    return ("T", "T^2", *gradient, f"diff(T){recorded.options()}")


def compensation_of(found: Inference, causes: Sequence[Cause], named: Sequence[Cause]) -> Compensation:
    """The constants' features, and every candidate's: in the form found, else in its likeliest one.

    `named` are those of the causes that a model made of the diagnosis takes.
    """
    scene = found.setting.scene
    recorded, families, nodes = Recorded.by(scene), found.columns.families, found.columns.nodes
    forms: dict[str, list[Form]] = {}
    beside = [m for c in named for m in c.members]
    for f, member in found.search.best_members(beside).items():
        forms[families[f].id] = [nodes[member.node].shape]
    for cause in causes:
        forms[cause.ids[0]] = [nodes[m.node].shape for m in cause.members]
    counted = {c.ids[0] for c in named} | {declared.id for declared, _ in found.plant.on}
    told = []
    for id, declared in scene.candidates.items():
        features, reason = features_of(declared, forms.get(id, [{}]), recorded)
        told.append(Compensable(id, id in counted, features, reason))
    return Compensation(constants_features(recorded), tuple(told))


def features_of(declared: Effect, forms: Sequence[Form], recorded: Recorded) -> tuple[tuple[str, ...], str]:
    """Features that hold an effect in the forms given, or none and why."""
    if declared.stage in ("scale_factor", "loop"):
        return (), "it goes with the rate: --model joint fits a scale factor over temperature"
    if declared.drawn_per_run or declared.family in ("line", "power_cycles", "sensor_steps"):
        return (), "it is drawn anew on each run, so that no run tells the next one's"
    if declared.stage == "noise":
        return (), "it is noise"
    if declared.family == "ageing":
        return (), "it goes with the unit's own days, which no feature knows: calibrate again"
    span = _SPANS.get(declared.family, _by_needs(declared))
    features = tuple(dict.fromkeys(text for form in forms for text in span(form, recorded)))
    if not features:
        return (), "the runs do not record what drives it"
    return features, ""


Span = Callable[[Form, Recorded], list[str]]


def _place(form: Form, recorded: Recorded) -> tuple[str, float]:
    return recorded.signal(str(form.get("place", "")))


def _loops(form: Form, recorded: Recorded) -> list[str]:
    x, _ = _place(form, recorded)
    width = form.get("half_width")
    widths = thermal.HALF_WIDTHS_DEGC if width is None else (0.7 * width, width, 1.4 * width)
    plays = [f"play({x}, {w:.4g} degC)^1..{LOOP_POWERS}" for w in widths]
    return [*plays, f"({x})^3"]


def _warm_up(form: Form, recorded: Recorded) -> list[str]:
    return [f"since_on({tau:g} s)" for tau in thermal.WARM_UPS_S] if recorded.powered_on else []


def _wave(form: Form, recorded: Recorded) -> list[str]:
    x, late = _place(form, recorded)
    frequency = 1.0 / float(form.get("period", 10.0))
    near = [frequency + apart / recorded.span_degc for apart in NEIGHBOURS]
    names, end = (("late_sine", "late_cosine"), f", {late:g} s") if late else (("sine", "cosine"), "")
    return [f"{name}({x}, {1.0 / f:.5g} degC{end})" for f in near if f > 0.0 for name in names]


def _transition(form: Form, recorded: Recorded) -> list[str]:
    x, _ = _place(form, recorded)
    rate, width = recorded.rate(x), float(form.get("width", 5.0))
    centre = float(form.get("transition_temperature", 25.0))
    half = 0.5 * thermal.TRANSITION_STEP_DEGC
    steps = [f"transition({x}, {c:g} degC, {width:g} degC)" for c in (centre - half, centre, centre + half)]
    return [*steps, rate, *(f"{step}^1..2*{rate}" for step in steps)]


def _hidden(form: Form, recorded: Recorded) -> list[str]:
    return _lags(form, recorded, thermal.NODE_LAGS_S)


def _relaxing(form: Form, recorded: Recorded) -> list[str]:
    return _lags(form, recorded, thermal.RELAXATIONS_S)


def _lags(form: Form, recorded: Recorded, lags_s: Sequence[float]) -> list[str]:
    x, _ = _place(form, recorded)
    return [x, *(f"lag({x}, {tau:g} s)" for tau in lags_s)]


def _rate_product(form: Form, recorded: Recorded) -> list[str]:
    x, _ = _place(form, recorded)
    rates = [recorded.rate(x), recorded.rate(x, 200.0)]
    return [*rates, *(f"({x})^1..2*{rate}" for rate in rates)]


def _rate(form: Form, recorded: Recorded) -> list[str]:
    x, _ = _place(form, recorded)
    return [recorded.rate(x), f"({x})^1..2*{recorded.rate(x)}"]


def _shupe(form: Form, recorded: Recorded) -> list[str]:
    if not recorded.faces:
        return []
    pairs = ["T_out-T_in"]
    if "T_case" in recorded.columns:
        pairs.append("T_case-0.5*T_in-0.5*T_out")
    lags_s = [s for s in thermal.SHUPE_LAGS_S if s >= recorded.window_s / 2.0 or s == 0.0]
    return [recorded.rate(pair, s) for pair in pairs for s in lags_s]


def _static(form: Form, recorded: Recorded) -> list[str]:
    x, _ = _place(form, recorded)
    return [f"({x})^1..7"]


def _machines(form: Form, recorded: Recorded) -> list[str]:
    duties = [name for name in ("heater", "compressor") if name in recorded.columns]
    lags_s = [s for s in other.MACHINE_LAGS_S if s > 0.0]
    return [text for n in duties for text in (n, *(f"lag({n}, {s:g} s)" for s in lags_s))]


def _supply(form: Form, recorded: Recorded) -> list[str]:
    return ["supply"] if "supply" in recorded.columns else []


def _vibration(form: Form, recorded: Recorded) -> list[str]:
    return ["vibration^1..4"] if "vibration" in recorded.columns else []


def _moisture(form: Form, recorded: Recorded) -> list[str]:
    if "humidity" not in recorded.columns:
        return []
    lags = [f"lag(humidity, {s:g} s)" for s in other.MOISTURE_S[:3]]
    return ["humidity", *lags, "T*humidity", *(f"T*{lag}" for lag in lags)]


def _leads(form: Form, recorded: Recorded) -> list[str]:
    x, _ = recorded.signal("")
    near = [n for n in ("T_electronics", "T_case", "T_chamber") if n in recorded.columns]
    return [recorded.rate(x), recorded.rate(x, 600.0), *(recorded.rate(name) for name in near)]


def _late(form: Form, recorded: Recorded) -> list[str]:
    """What readings that are late, or an output that is, miss: rates, through the nominal's slopes."""
    names = ("T_in", "T_out") if recorded.faces else ("T",)
    return [text for n in names for text in (recorded.rate(n), f"{n}*{recorded.rate(n)}")]


def _elsewhere(form: Form, recorded: Recorded) -> list[str]:
    """What readings at another place miss: that place's temperature, through the nominal's slopes."""
    x, _ = recorded.signal("")
    near = [n for n in ("T_case", "T_chamber", "T_electronics") if n in recorded.columns]
    places = [*near, f"lag({x}, 600 s)"]
    return [text for p in places for text in (p, f"({x})*{p}")]


def _by_needs(declared: Effect) -> Span:
    """Of an effect with a signature of its own: what it states to need, where runs record that."""

    def span(form: Form, recorded: Recorded) -> list[str]:
        texts = [f"{name}^1..2" for name in ("T_electronics", "supply") if name in declared.needs]
        if "angle" in declared.needs:
            texts += ["sine(angle, 360 deg)", "cosine(angle, 360 deg)"]
        texts += [name for name in ("B_x", "B_y", "B_z") if name in declared.needs]
        return [text for text in texts if set(re.findall(r"[A-Za-z_]+", text)) & recorded.columns]

    return span


_SPANS: dict[str, Span] = {
    "loops": _loops,
    "warm_up": _warm_up,
    "wave": _wave,
    "transition": _transition,
    "hidden_node": _hidden,
    "relaxation": _relaxing,
    "rate_product": _rate_product,
    "rate": _rate,
    "gradient_rate": _shupe,
    "static": _static,
    "machines": _machines,
    "supply": _supply,
    "vibration": _vibration,
    "moisture": _moisture,
    "leads": _leads,
    "sensor_lag": _late,
    "clock_skew": _late,
    "sensor_placement": _elsewhere,
}
"""Spans by the family that an effect declares, as `fogml.gap.catalogue.FAMILIES`."""
