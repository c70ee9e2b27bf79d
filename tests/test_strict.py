"""Content of files is held to what is stated of it, as a model and as a dataclass."""

import math
from dataclasses import dataclass

import pytest
from pydantic import with_config

from fogml.errors import InputError
from fogml.runs.facts import Facts
from fogml.strict import CONTENT, Strict, as_written, strictly


class Model(Strict):
    size: float
    names: list[str] = []


@with_config(CONTENT)
@dataclass(frozen=True)
class Data:
    size: float
    names: tuple[str, ...] = ()


@pytest.mark.parametrize("kind", [Model, Data])
@pytest.mark.parametrize("size", [math.nan, math.inf, True, "1", None])
def test_only_finite_numbers_are_numbers(kind, size):
    with pytest.raises(InputError, match=r"key 'part\.size'"):
        strictly(kind, {"size": size}, "part")


@pytest.mark.parametrize("kind", [Model, Data])
def test_what_is_written_is_read_and_no_key_beside_it(kind):
    held = strictly(kind, {"size": 2, "names": ["a", "b"]})
    assert held.size == 2.0 and list(held.names) == ["a", "b"]
    assert strictly(kind, as_written(held)) == held
    with pytest.raises(InputError, match="key 'sizes'"):
        strictly(kind, {"sizes": 2.0})


@pytest.mark.parametrize(
    ("stated", "key"), [({"latitude": 100.0}, "latitude"), ({"axes": {"x": {"input_axis": 3}}}, "axes.x")]
)
def test_what_is_made_by_a_call_is_refused_as_a_file_s_content_is(stated, key):
    with pytest.raises(InputError, match=f"Facts: key '{key}.*found"):
        Facts(**stated)
    with pytest.raises(InputError, match="Model: key 'size'"):
        Model(size="1")
