"""Rests of form: what a group can make of an effect, against plain least squares."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.gap.forms import UNLIKE, Forms
from fogml.gap.priors import LENGTHS
from tests.gap.test_search import CUBE, searched


def test_a_share_is_what_least_squares_explain_of_the_response():
    search = searched((CUBE,))
    basis, forms = search.field_.basis, Forms(search.field_)
    fixed = basis.rows[:, basis.constants]
    # Constants with their priors: rows of their own below the data's.
    padded = np.concatenate([fixed, np.eye(fixed.shape[1])])

    def beside(columns):
        whole = np.concatenate([columns, np.zeros((fixed.shape[1], columns.shape[1]))])
        return whole - padded @ np.linalg.lstsq(padded, whole, rcond=None)[0]

    node = int(search.places["cube"][0])
    response = beside(basis.rows[:, list(basis.nodes[node].columns)])
    made = forms.made(node)
    for share, (name, places) in zip(made, basis.groups.items()):
        columns = beside(basis.rows[:, places])
        left = response - columns @ np.linalg.lstsq(columns, response, rcond=1e-3)[0]
        assert share == pytest.approx(1.0 - np.sum(left**2) / np.sum(response**2), abs=1e-3), name
    by_name = dict(zip(basis.groups, made))
    assert by_name["temperature"] > 0.95 > 0.5 > by_name["start"]


def test_a_rest_has_the_weight_of_the_effect_that_it_may_belong_to():
    search = searched((CUBE,))
    forms = Forms(search.field_)
    cube, line = (int(search.places[id][0]) for id in ("cube", "line"))
    both = np.exp(forms.log_weights([(cube, 10.0), (line, 5.0)]))
    assert np.all(both[:, LENGTHS > 10.0] == UNLIKE)
    ten = LENGTHS == 10.0
    np.testing.assert_allclose(both[:, ten], np.maximum(forms.made(cube), UNLIKE)[:, None])
    least = np.maximum(np.maximum(forms.made(cube), forms.made(line)), UNLIKE)
    np.testing.assert_allclose(both[:, LENGTHS == 5.0], least[:, None])
