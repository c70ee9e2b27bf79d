"""Every effect of the catalogue keeps the contract, and the catalogue hangs together."""

from __future__ import annotations

import pytest

from fogml.testing import check_effect
from fogml.twin.registry import effects


@pytest.mark.parametrize("id", list(effects()))
def test_effect_keeps_the_contract(id: str) -> None:
    check_effect(id)


@pytest.mark.parametrize("id", list(effects()))
def test_named_relatives_are_effects(id: str) -> None:
    declared = effects()[id]
    others = {*declared.confused_with, *declared.conflicts}
    assert others <= set(effects()), (
        f"{id} names effects that do not exist: {sorted(others - set(effects()))}"
    )
