"""Replay: a run's inputs through a twin, or the difference that one effect makes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable, Mapping
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path
from weakref import finalize

import numpy as np

from fogml.errors import InputError
from fogml.runs.attitude import earth_field, with_table_axis
from fogml.runs.columns import coil_sensor_number
from fogml.runs.exchange import one_run
from fogml.runs.run import FloatArray, Run
from fogml.runs.steps import noisy_beyond
from fogml.twin.chain import hidden, through_chain
from fogml.twin.effect import Effect, SensorEffect, ThermalEffect
from fogml.twin.inputs import REST, STAND_INS, Inputs
from fogml.twin.plant.estimate import estimate_nodes, recorded_power
from fogml.twin.plant.heat import PowerWindows, windows_since
from fogml.twin.recorder import logged
from fogml.twin.truth import Truth
from fogml.twin.twin import RATE_WINDOW_S, EffectSetting, Twin
from fogml.twin.twin_file import as_twin

_CACHE_BYTES = 256_000_000
_LONGEST_ON_S = 1e8
"""No unit has been on, and no clock with it, for three years [s]: later times are dates."""
QUIET_DEGC = 2.5e-4
"""Readings with less noise give their rates from neighbour to neighbour, as true nodes do."""


def replay(
    twin: Twin | str | Path, run: Run, *, only: str | None = None, truth: Truth | None = None
) -> FloatArray:
    """What the twin's gyro would have put out without noise, for what a run recorded.

    Parameters
    ----------
    twin
        A twin, or the name or file of one.
    run
        Its temperatures, table rate, drives and set-up facts are the inputs. Nodes that it lacks and
        an effect asks for follow from those that it has by the twin's plant.
    only
        Id of an effect: the difference that it makes, in place of the whole output.
    truth
        The truth of a simulated run, whose nodes and drives then take the place of the recorded.

    Returns
    -------
    FloatArray
        Output [deg/h], shape (n,).

    Raises
    ------
    InputError
        If a temperature is missing, the truth is another run's, or `only` is not on.

    Notes
    -----
    Signatures are kept with the run: a second replay with one effect changed works out that one
    alone.
    """
    twin, run = as_twin(twin), one_run(run)
    if id(run) not in _replayers:
        finalize(run, _replayers.pop, id(run), None)
    held = _replayers.setdefault(id(run), {})
    replayer = held.get(id(truth))
    if replayer is None or replayer.truth is not truth:
        replayer = held[id(truth)] = Replayer(run, truth)
    return replayer.output(twin) if only is None else replayer.difference(twin, only)


def inputs_of_run(run: Run) -> tuple[Inputs, PowerWindows]:
    """What a run recorded, as inputs, and when the unit was on."""
    run = run.without_dropouts
    windows = recorded_power(run)
    temperatures = {
        name: run.columns[name] for name in run.temperature_columns if coil_sensor_number(name) is None
    }
    sensors = {}
    for name in ("T_in", "T_out"):
        held = run.sensors(name)
        if name not in temperatures and held:
            temperatures[name] = run.temperature(name)
            sensors[name] = [run.columns[sensor] for sensor in held]
    drives = {name: run.columns[name] for name in (*REST, "angle") if name in run.columns}
    # The air itself is never quiet.
    noisy = any(noisy_beyond(t, QUIET_DEGC) for name, t in temperatures.items() if name != "T_chamber")
    inputs = Inputs(
        time=run.time,
        temperatures=temperatures,
        table_rate=run.rate,
        earth_deg_h=run.facts.earth_rate_deg_h or 0.0,
        facts=with_table_axis(run.facts, run.rate),
        powered_on_s=windows[0][0],
        power_ons_s=tuple(on for on, _ in windows[1:]),
        power_offs_s=tuple(off for _, off in windows[:-1]),
        drives=drives,
        sensors=sensors,
        rate_window_s=RATE_WINDOW_S if noisy else 0.0,
        epoch_s=run.facts.epoch_s - dates_s(run),
        angle_begins_anew="angle" in drives and float(np.ptp(drives["angle"])) <= 360.0,
        hindsight=noisy,
    )
    return inputs, windows


def dates_s(run: Run) -> float:
    """Time of a run's first sample where its clock tells dates, as seconds since 1970 do, else 0 [s]."""
    first = float(run.time[0])
    return first if first > _LONGEST_ON_S else 0.0


def inputs_of_truth(truth: Truth, run: Run) -> Inputs:
    """The true inputs behind a simulated run."""
    truth.check_fits(run.time, run.name)
    windows = windows_since(truth.time, truth.time_on)
    ons = [on for on, _ in windows]
    return Inputs(
        time=truth.time,
        temperatures=truth.nodes,
        table_rate=truth.table_rate,
        earth_deg_h=run.facts.earth_rate_deg_h or 0.0,
        facts=run.facts,
        powered_on_s=ons[0],
        power_ons_s=tuple(ons[1:]),
        power_offs_s=tuple(off for _, off in windows[:-1]),
        drives=truth.drives,
        rate_window_s=0.0,
        epoch_s=run.facts.epoch_s - dates_s(run),
    )


@dataclass
class _Given:
    """Inputs for effects and for the nominal gyro, and what tells them from others of the same run."""

    key: Hashable
    inputs: Inputs
    nominal: Inputs


class Replayer:
    """Replays of one run; what several replays share is worked out once.

    Parameters
    ----------
    run
        The run.
    truth
        Its truth, where that is to be replayed.

    Attributes
    ----------
    recorded
        What the run recorded, or the truth, as inputs.
    windows
        When the unit was on, as recorded; none with a truth.
    """

    def __init__(self, run: Run, truth: Truth | None = None) -> None:
        self.truth = truth
        if truth is None:
            self.recorded, self.windows = inputs_of_run(run)
        else:
            self.recorded, self.windows = inputs_of_truth(truth, run), ()
        self._given: dict[Hashable, _Given] = {}
        self._signatures: OrderedDict[Hashable, FloatArray] = OrderedDict()

    def with_temperatures(self, temperatures: Mapping[str, FloatArray]) -> Replayer:
        """Replays of the same run with its recorded temperatures changed [degC], shape (n,) each."""
        other = copy(self)
        other.recorded = replace(self.recorded.afresh(), temperatures=temperatures, sensors={}, cache={})
        other._given, other._signatures = {}, OrderedDict()
        return other

    def output(self, twin: Twin) -> FloatArray:
        """Noise-free output [deg/h], shape (n,)."""
        given = self._inputs(twin)

        def signature(declared: Effect, setting: EffectSetting, inputs: Inputs) -> FloatArray:
            if self.truth is not None and declared.seeded and declared.id in self.truth.contributions:
                # Only the truth holds what the simulation drew.
                return self.truth.contributions[declared.id] / (setting.amplitude or 1.0)
            # What depends on the nominal gyro's slopes changes with its constants.
            slopes = twin.nominal if isinstance(declared, SensorEffect | ThermalEffect) else None
            key = (given.key, declared, setting.key, slopes)
            return self._kept(key, declared, setting, inputs)

        chain = through_chain(
            twin,
            given.inputs.afresh(),
            given.nominal.afresh(),
            signature=signature,
            trusting=self.truth is None,
        )
        return logged(twin, chain.output, given.inputs.afresh()).output

    def difference(self, twin: Twin, id: str) -> FloatArray:
        """What an effect changes in the output [deg/h], shape (n,).

        Raises
        ------
        InputError
            If it is not on, or acts by way of nodes or sensors, which a truth holds fixed.
        """
        without = twin.without_effect(id)
        if self.truth is not None:
            acting = [d for d, _ in twin.on if d.id == id]
            if isinstance(acting[0], SensorEffect) or (
                isinstance(acting[0], ThermalEffect) and not hidden(acting[0])
            ):
                if id in self.truth.contributions:
                    return self.truth.contributions[id]
                raise InputError(
                    f"effect '{id}' acts by way of the temperatures, which the truth holds fixed; "
                    "replay the recorded columns"
                )
        return self.output(twin) - self.output(without)

    def _kept(self, key: Hashable, declared: Effect, setting: EffectSetting, inputs: Inputs) -> FloatArray:
        if key in self._signatures:
            self._signatures.move_to_end(key)
            return self._signatures[key]
        found = declared.in_hindsight(inputs.afresh(), **setting.shape)
        room = _CACHE_BYTES // max(found.nbytes, 1)
        if room:
            while len(self._signatures) >= room:
                self._signatures.popitem(last=False)
            self._signatures[key] = found
        return found

    def _inputs(self, twin: Twin) -> _Given:
        """Inputs for a twin: recorded, or with the nodes that its effects ask for besides."""
        recorded = self.recorded
        needed = {need for declared, _ in twin.on for need in declared.needs if need in STAND_INS}
        missing = needed - set(recorded.temperatures) - ({"T"} if recorded.place("T") else set())
        around = self._around(twin)
        if self.truth is not None or not missing or not recorded.temperatures:
            if around not in self._given:
                given = self.surrounded(twin, recorded)
                self._given[around] = _Given(around, given, given)
            return self._given[around]
        changes = tuple((d, s.amplitude, s.key) for d, s in twin.thermal)
        key = (twin.plant, changes, around, twin.network.names)
        if key not in self._given:
            nodes = estimate_nodes(
                twin.network,
                recorded.time,
                recorded.temperatures,
                powered=self.windows,
                fan=recorded.drives.get("fan"),
                table_rate=recorded.afresh().turning_deg_s,
            )
            nominal = self.surrounded(twin, recorded)
            inputs = replace(nominal.afresh(), temperatures={**nodes, **recorded.temperatures}, cache={})
            # Bounded: a fit may try many plants.
            if len(self._given) > 8:
                self._given.clear()
            self._given[key] = _Given(key, inputs, nominal)
        return self._given[key]

    def _around(self, twin: Twin) -> tuple[Hashable, ...]:
        """What of a twin is an input: coil and light, and the field about it where none is recorded."""
        outside, fields = twin.surroundings, {"B_x", "B_y", "B_z"}
        asked = any(fields & set(declared.needs) for declared, _ in twin.on)
        unit = (twin.coil, twin.light)
        if not asked or fields & set(self.recorded.drives):
            return unit
        return *unit, outside.horizontal_field, outside.vertical_field

    def surrounded(self, twin: Twin, recorded: Inputs) -> Inputs:
        """The recorded inputs with what `_around` tells."""
        given, outside = replace(recorded, coil=twin.coil, light=twin.light), twin.surroundings
        if len(self._around(twin)) == 2:
            return given
        angle = given.afresh().angle_deg
        field = earth_field(given.facts, angle, outside.horizontal_field, outside.vertical_field)
        return replace(given, drives={**given.drives, **field})


_replayers: dict[int, dict[int, Replayer]] = {}
"""By the identity of runs that are there: whether another holds the same takes reading all of both."""
