"""Shares of the gap's energy against Shapley's value from all orders."""

from dataclasses import replace
from itertools import permutations
from types import SimpleNamespace

import numpy as np
import pytest

from fogml.gap.causes import cause_shares, energy, shapley_values
from fogml.gap.field import Member
from fogml.gap.how_far import Foretold
from fogml.gap.inference import foreseen
from fogml.gap.model import TwinModel
from fogml.gap.settings import STANDARD
from fogml.runs.run import Run
from fogml.signals.noise_model import NoiseModel
from fogml.twin.twin_file import load_twin
from tests.play_operator import play


def test_values_are_what_each_cause_adds_on_average_over_all_orders():
    rng = np.random.default_rng(3)
    gap, courses = rng.standard_normal(30), rng.standard_normal((30, 3))

    def taken(causes):
        return float(gap @ gap - np.sum((gap - courses[:, list(causes)].sum(axis=1)) ** 2))

    expected = np.zeros(3)
    for order in permutations(range(3)):
        for place, cause in enumerate(order):
            expected[cause] += (taken(order[: place + 1]) - taken(order[:place])) / 6.0
    values = shapley_values(gap, courses).sum(axis=0)
    assert values == pytest.approx(expected, rel=1e-12)
    assert values.sum() == pytest.approx(taken((0, 1, 2)))


def test_energy_is_of_what_constants_do_not_take_up():
    """A constant of each run has energy but for the part that all have in common: the bias."""
    time, sizes = 60.0 * np.arange(400), np.array([4.1, 3.8, 4.4])
    course = 25.0 + 30.0 * np.sin(time / 3000.0)
    runs = [Run.from_columns(f"r{i}", time=time, gyro=np.zeros(400), T=course) for i in range(3)]
    held = foreseen(TwinModel(load_twin("nominal")), runs, NoiseModel(0.002, 0.0, 0.0), STANDARD).field
    scene = held.setting.scene
    held.base = replace(
        held.base, data=held.whitening.stacked([np.full(len(r), size) for r, size in zip(scene.fit, sizes)])
    )
    node = next(
        i
        for i, n in enumerate(held.columns.nodes)
        if held.columns.families[n.family].id == "turn_on_bias" and i in held.at
    )
    member = Member(held.columns.nodes[node].family, node, 1e4)
    found = SimpleNamespace(field=held, scene=scene, setting=held.setting, columns=held.columns)
    every, recalibrated = Foretold.of(found, (member,)), Foretold.of(found, ())
    expected = len(scene.fit[0]) * np.sum((sizes - sizes.mean()) ** 2)
    assert energy(found, every, recalibrated, member) == pytest.approx(expected, rel=0.01)


def test_a_cause_has_its_share_where_a_random_walk_has_most_of_the_energy():
    """Of a hysteresis alone, beside a constant of each run that is none: all, whatever the walk does."""
    rng, time, noise = np.random.default_rng(5), 60.0 * np.arange(600), NoiseModel(0.002, 0.0, 0.02)
    twin = TwinModel(load_twin("nominal"))
    for _ in range(3):
        runs = []
        for i, slow in enumerate((2500.0, 4000.0)):
            course = 25.0 + 30.0 * np.sin(time / slow)
            gyro = 0.006 * (play(course, 8.0) - course) + 0.002 * 60.0**0.5 * rng.standard_normal(600)
            gyro += 0.02 * np.cumsum(rng.standard_normal(600)) / 60.0**0.5
            runs.append(Run.from_columns(f"r{i}", time=time, gyro=gyro, T=course))
        held = foreseen(twin, runs, noise, STANDARD).field
        families, nodes = held.columns.families, held.columns.nodes
        at = {families[n.family].id: i for i, n in enumerate(nodes) if i in held.at}
        chosen = (("thermal_hysteresis", 20.0), ("turn_on_bias", 6.0))
        members = tuple(Member(nodes[at[id]].family, at[id], size) for id, size in chosen)
        found = SimpleNamespace(
            field=held,
            scene=held.setting.scene,
            setting=held.setting,
            columns=held.columns,
            kind=lambda m, named=families: named[m.family].kind,
        )
        every, recalibrated = Foretold.of(found, members), Foretold.of(found, ())
        judged = SimpleNamespace(best=SimpleNamespace(members=members))
        told = [s for s in cause_shares(found, judged, every, recalibrated, 0) if s.regime is None]
        assert {s.run for s in told} == {None, "r0", "r1"}
        for share in told:
            assert share.share == pytest.approx(float(share.effect == "thermal_hysteresis"), abs=0.15)
