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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fogml.gap.inference import Inference
from fogml.gap.posterior import Cause
from fogml.gap.result_parts import Compensable, Compensation
from fogml.gap.scene import Scene
from fogml.gap.settings import STANDARD, Priors
from fogml.numerals import ascii_number
from fogml.twin.effect import Effect
from fogml.twin.inputs import REST, STAND_INS

Form = Mapping[str, Any]


@dataclass(frozen=True)
class Recorded:
    """What the runs record, for features.

    Attributes
    ----------
    columns
        Recorded on all runs; both faces of the coil where sensors tell them.
    window_s
        Of rates and differences: as the nominal twin's, or two samples where those are longer.
    powered_on
        Whether all runs say when power came on.
    span_degc
        Range of temperature.
    priors
        What is taken for granted.
    """

    columns: frozenset[str]
    window_s: float
    powered_on: bool
    span_degc: float
    priors: Priors = STANDARD

    @classmethod
    def by(cls, scene: Scene, priors: Priors) -> Recorded:
        """What all runs of a scene record."""
        runs = [r.run for r in scene.runs]
        columns = frozenset.intersection(*(frozenset(run.columns) for run in runs))
        if all(run.sensors("T_in") and run.sensors("T_out") for run in runs):
            columns |= {"T_in", "T_out"}
        on = all(run.facts.powered_on is not None for run in runs)
        window_s = max(priors.reported.feature_window_s, 2.0 * max(run.sample_s for run in runs))
        return cls(columns, window_s, on, scene.span_degc, priors)

    @property
    def faces(self) -> bool:
        """Whether both faces of the coil are told."""
        return {"T_in", "T_out"} <= self.columns

    def signal(self, place: str) -> tuple[str, float]:
        """Text of the temperature of a place that drives a cause, and how late it is behind that [s]."""
        late = re.search(r", ([0-9.]+) s late$", place)
        lag_s = float(late[1]) if late else 0.0
        name = place[: late.start()] if late else place
        stated = {"recorded electronics": "T_electronics", "chamber air": "T_chamber"}
        if stated.get(name) in self.columns:
            return stated[name], lag_s
        if not self.faces:
            return "T", lag_s
        mixed = {"inner face": "T_in", "outer face": "T_out", "hub": "1.5*T_in-0.5*T_out"}
        return mixed.get(name, "0.5*T_in+0.5*T_out"), lag_s

    def change(self, signal: str, how: str = "d", lag_s: float = 0.0) -> str:
        """Text of a signal's rate ``d``, behind a lag or not, or of its difference ``diff``."""
        options = f"[exp, {lag_s:g} s]" if lag_s else f"[block, {self.window_s:g} s]"
        plain = not lag_s and self.window_s == self.priors.reported.feature_window_s
        return f"{how}({signal}){'' if plain else options}"

    def of(self, *names: str) -> list[str]:
        """Those of the names that are recorded."""
        return [name for name in names if name in self.columns]


def constants_features(recorded: Recorded) -> tuple[str, ...]:
    """The nominal twin's bias as features: its slope and curvature, its gradient, its response to DeltaT."""
    gradient = ("T_in-T_out",) if recorded.faces else ()
    return ("T", "T^2", *gradient, recorded.change("T", "diff"))


def compensation_of(found: Inference, causes: Sequence[Cause], named: Sequence[Cause]) -> Compensation:
    """The constants' features, and every candidate's: in the form found, else in its likeliest one.

    `named` are those of the causes that a model made of the diagnosis takes.
    """
    recorded = Recorded.by(found.scene, found.setting.priors)
    families, nodes = found.columns.families, found.columns.nodes
    forms: dict[str, list[Form]] = {}
    beside = [m for c in named for m in c.members]
    for f, member in found.search.best_members(beside).items():
        forms[families[f].id] = [nodes[member.node].shape]
    for cause in causes:
        forms[cause.ids[0]] = [nodes[m.node].shape for m in cause.members]
    counted = {c.ids[0] for c in named} | {declared.id for declared, _ in found.plant.on}
    told = []
    for id, declared in found.scene.candidates.items():
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
    texts = (text for form in forms for text in _span(declared, form, recorded))
    features = tuple(dict.fromkeys(texts))
    driving = set(declared.needs) - {"earth", "facts", "output", "slopes", "powered_on"}
    stated = declared.family != "signature" or declared.compensated_by
    unknown = not stated and driving <= recorded.columns | {"T"}
    reason = "no features that hold it are stated" if unknown else "the runs do not record what drives it"
    return features, "" if features else reason


def _span(declared: Effect, form: Form, recorded: Recorded) -> list[str]:
    """Features that hold what an effect's family can do in a form."""
    grids, reported = recorded.priors.grids, recorded.priors.reported
    x, late = recorded.signal(str(form.get("place", "")))
    rate = recorded.change(x)
    match declared.family:
        case "loops":
            width = form.get("half_width")
            widths = grids.half_widths_degc if width is None else (0.7 * width, width, 1.4 * width)
            return [
                *(f"play({x}, {ascii_number(w, 4)} degC)^1..{reported.loop_powers}" for w in widths),
                f"({x})^3",
            ]
        case "warm_up":
            return [f"since_on({tau:g} s)" for tau in grids.warm_ups_s] if recorded.powered_on else []
        case "wave":
            near = [
                1.0 / float(form.get("period", 10.0)) + a / recorded.span_degc for a in reported.near_waves
            ]
            names, end = (("late_sine", "late_cosine"), f", {late:g} s") if late else (("sine", "cosine"), "")
            return [f"{name}({x}, {1.0 / f:.5g} degC{end})" for f in near if f > 0.0 for name in names]
        case "transition":
            width, half = float(form.get("width", 5.0)), 0.5 * grids.transition_step_degc
            middle = float(form.get("transition_temperature", 25.0))
            centres = (middle - half, middle, middle + half)
            steps = [f"transition({x}, {c:g} degC, {width:g} degC)" for c in centres]
            return [*steps, rate, *(f"{step}^1..2*{rate}" for step in steps)]
        case "hidden_node" | "relaxation":
            lags_s = grids.node_lags_s if declared.family == "hidden_node" else grids.relaxations_s
            return [x, *(f"lag({x}, {tau:g} s)" for tau in lags_s)]
        case "rate_product":
            rates = [rate, *(recorded.change(x, lag_s=s) for s in grids.product_lags_s if s)]
            return [*rates, *(f"({x})^1..2*{one}" for one in rates)]
        case "rate":
            return [rate, f"({x})^1..2*{rate}"]
        case "gradient_rate":
            pairs = ["T_out-T_in"] if recorded.faces else []
            if pairs and "T_case" in recorded.columns:
                pairs.append("T_case-0.5*T_in-0.5*T_out")
            lags_s = tuple(s for s in grids.shupe_lags_s if s >= recorded.window_s / 2.0 or s == 0.0)
            return [recorded.change(pair, lag_s=s) for pair in pairs for s in lags_s]
        case "static":
            return [f"({x})^1..7"]
        case "machines":
            lags_s = tuple(s for s in grids.machine_lags_s if s > 0.0)
            duties = recorded.of("heater", "compressor")
            return [text for n in duties for text in (n, *(f"lag({n}, {s:g} s)" for s in lags_s))]
        case "supply":
            return recorded.of("supply")
        case "vibration":
            return [f"{n}^1..4" for n in recorded.of("vibration")]
        case "moisture":
            lags = [f"lag(humidity, {s:g} s)" for s in grids.moisture_s[:3]]
            told = ["humidity", *lags, "T*humidity", *(f"T*{lag}" for lag in lags)]
            return told if "humidity" in recorded.columns else []
        case "leads":
            x, _ = recorded.signal("")
            near_s = recorded.change(x, lag_s=grids.lead_lags_s[0])
            places = recorded.of("T_electronics", "T_case", "T_chamber")
            return [recorded.change(x), near_s, *(recorded.change(name) for name in places)]
        case "sensor_lag" | "clock_skew":
            # What readings that are late, or an output that is, miss: rates, through the nominal's slopes.
            faces = ("T_in", "T_out") if recorded.faces else ("T",)
            return [text for n in faces for text in (recorded.change(n), f"{n}*{recorded.change(n)}")]
        case "sensor_placement":
            # What readings at another place miss: its temperature, through the nominal's slopes.
            x, _ = recorded.signal("")
            places = recorded.of("T_case", "T_chamber", "T_electronics")
            places.append(f"lag({x}, {grids.placement_lag_s:g} s)")
            return [text for place in places for text in (place, f"({x})*{place}")]
        case _ if declared.compensated_by:
            shape = {**declared.default_shape(), **form}
            texts = [text.format(**shape) for text in declared.compensated_by]
            there = recorded.columns | {"T"}
            return texts if {*STAND_INS, *REST} & set(_words(", ".join(texts))) <= there else []
        case _:
            # What it states to need, where runs record that.
            needs = set(declared.needs)
            texts = [f"{name}^1..2" for name in ("T_electronics", "supply") if name in needs]
            if "angle" in needs:
                texts += ["sine(angle, 360 deg)", "cosine(angle, 360 deg)"]
            texts += [name for name in ("B_x", "B_y", "B_z") if name in needs]
            return [text for text in texts if set(_words(text)) & recorded.columns]


def _words(text: str) -> list[str]:
    return re.findall(r"[A-Za-z_]\w*", text)
