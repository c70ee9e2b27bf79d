"""What all tests share: hypothesis repeats itself, taking its time; noise of a series is fitted once.

The garbage collector waits until libraries and tests are loaded and passes them over then: going through them
takes time.
"""

from __future__ import annotations

import gc
import pickle
from collections.abc import Callable, Iterator
from functools import wraps
from hashlib import sha256
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


gc.disable()


def pytest_collection_finish() -> None:
    gc.collect()
    gc.freeze()
    gc.enable()
    gc.set_threshold(20_000, 10, 10)


@pytest.fixture(scope="session", autouse=True)
def noise_fitted_once() -> Iterator[None]:
    """Judgements and reports of the same run take the same noise models: most of their time goes there.

    What `fogml.signals` gives is the same for the same numbers, and its own tests call it unwrapped.
    """
    from fogml.runs import noise_of_run
    from fogml.validation import floors

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(noise_of_run, "noise_terms", _remembered(noise_of_run.noise_terms))
        patch.setattr(floors, "floor_model", _remembered(floors.floor_model))
        yield


def _remembered(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, worked out once for each content of its arguments."""
    known: dict[bytes, Any] = {}

    @wraps(function)
    def remembered(*arguments: Any, **named: Any) -> Any:
        rows = np.arange(len(arguments[0])) if isinstance(arguments[0], np.ndarray) else None
        # Columns of a series are told by a function of its places.
        told = [each(rows) if callable(each) else each for each in arguments]
        key = sha256(pickle.dumps((told, sorted(named.items())))).digest()
        if key not in known:
            known[key] = function(*arguments, **named)
        return known[key]

    return remembered
