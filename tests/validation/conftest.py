"""Fixtures of the tests of judgements."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from fogml.validation import judge


@pytest.fixture(scope="module")
def without_noise_terms() -> Iterator[None]:
    """Runs that tell no Allan terms: where they don't matter their fit takes most of a judgement's time."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(judge, "_noise", lambda run: None)
        yield
