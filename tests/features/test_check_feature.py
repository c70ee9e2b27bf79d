"""The contract check passes the shipped features and catches builders that break it."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.features.features import Features
from fogml.features.parse import parse_features
from fogml.testing import check_feature


@pytest.mark.parametrize(
    "text",
    [
        "T",
        "T, dT, T*dT",
        "T^1..5, dT^1..3",
        "T1^1..5, T2^1..5, T3^1..2, dT1^1..3, dT2^1..3",
        "T_in-T_out, d(T_in-T_out), sign(dT_in), T_in*sign(dT_in)",
        "dT[slope, 60 s], dT[exp, 120 s], dT[block, 30 s], diff(T), diff(T)[first]",
        "dT[first], diff(T)[slope, 20 s], diff(T)[exp, 30 s], sign(dT[exp, 200 s])",
        "d(0.5*T1+0.5*T3)*T2",
        "T, lag(T, 600 s), lag(T_in-T_out, 100 s)*T",
        "hysteresis(T), play(T, 0.5 degC)*dT",
        "since_on(400 s), T*since_on(1 h), lag(T, 60 s)",
        "T, beyond(T, -3 degC, 30.5 degC), T*beyond(power, 0, 20)",
        "power, d(power), supply^2, own_name*T, play(own_name, 2), lag(supply, 50 s)",
    ],
)
def test_shipped_features_keep_the_contract(text: str) -> None:
    check_feature(text)


class Ahead(Features):
    """Looks one sample ahead."""

    def atom_values(self, run, sample_s=None, **state):  # type: ignore[no-untyped-def]
        found = super().atom_values(run, sample_s, **state)
        return found._replace(values=np.roll(found.values, -1, axis=0))


class Leaky(Features):
    """Learns from what it transforms."""

    def transform(self, run, *, limited=False):  # type: ignore[no-untyped-def]
        columns = super().transform(run, limited=limited)
        if limited:
            self.fit([run])
        return columns


class Hard(Features):
    """Clips at the box's edge."""

    def limit(self, atom_values, full=None, *, linear=False):  # type: ignore[no-untyped-def]
        bounds = np.array(list(self.box.values()))
        _, outside = super().limit(atom_values, full)
        return np.clip(atom_values, bounds[:, 0], bounds[:, 1]), outside


class Frozen(Features):
    """Keeps stale values where windows are not full."""

    def atom_values(self, run, sample_s=None, **state):  # type: ignore[no-untyped-def]
        found = super().atom_values(run, sample_s, **state)
        found.values[~found.full] += 1.0
        return found


class Forgetful(Features):
    """Begins its memories anew with each block."""

    def atom_values(self, run, sample_s=None, memories=None, skip=0):  # type: ignore[no-untyped-def]
        return super().atom_values(run, sample_s, skip=skip)


@pytest.mark.parametrize(
    ("broken", "message"),
    [(Ahead, "later samples"), (Leaky, "changed the box"), (Hard, "corner"), (Frozen, "streaming")],
)
def test_broken_builders_are_caught(broken: type[Features], message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_feature(broken("T, dT"))


def test_a_memory_that_ends_with_a_block_is_caught() -> None:
    with pytest.raises(AssertionError, match="blocks"):
        check_feature(Forgetful("T, lag(T, 600 s)"))


def test_it_takes_features_and_text_alike() -> None:
    check_feature(parse_features("dT"))
