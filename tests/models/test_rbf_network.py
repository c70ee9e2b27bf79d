"""The network's value, its spread, and how it goes on beyond the rates it was trained at."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.models.rbf.evaluate import basis_functions, evaluate_network
from fogml.models.rbf.network import Network, solve_network
from fogml.models.rbf.rates import Edge

INPUTS, CENTRES = 3, 7


def network(edge: Edge | None = None) -> Network:
    draw = np.random.default_rng(3)
    return Network(
        columns=np.array([0, 2]),
        centres=draw.normal(size=(CENTRES, 2)),
        widths=draw.uniform(0.4, 2.0, size=(CENTRES, 2)),
        weights=draw.normal(size=CENTRES),
        linear=draw.normal(size=INPUTS),
        constant=0.7,
        edge=edge or Edge.none(),
    )


def written_out(net: Network, rows: np.ndarray) -> np.ndarray:
    """The network as its formula reads."""
    values = []
    for x in rows:
        exponents = (((x[net.columns] - net.centres) / net.widths) ** 2).sum(axis=1)
        values.append(net.constant + net.linear @ x + net.weights @ np.exp(-exponents))
    return np.array(values)


@pytest.mark.parametrize("count", [1, 255, 256, 257, 5000])
@pytest.mark.parametrize("threads", [1, 2])
def test_value_is_the_formula(count: int, threads: int) -> None:
    rows = 2.0 * np.random.default_rng(count).normal(size=(count, INPUTS))
    np.testing.assert_allclose(network()(rows, threads), written_out(network(), rows), rtol=0, atol=1e-13)


def test_threads_and_parts_do_not_change_a_bit() -> None:
    rows = np.random.default_rng(1).normal(size=(100_000, INPUTS))
    whole = network()(rows, 1)
    np.testing.assert_array_equal(network()(rows, 2), whole)
    np.testing.assert_array_equal(network()(rows[1234:2345], 1), whole[1234:2345])


def test_far_from_all_centres_nothing_but_the_linear_part_is_left() -> None:
    net = network()
    rows = np.array([[1e6, 0.0, -1e6], [30.0, 1.0, 30.0], [-1e150, 0.0, 0.0]])
    np.testing.assert_allclose(net(rows), net.constant + rows @ net.linear, rtol=1e-14)


def test_single_precision_keeps_its_stated_error() -> None:
    net = network()
    rows = 3.0 * np.random.default_rng(5).normal(size=(20_000, INPUTS))
    error = np.max(np.abs(net(rows, single=True) - net(rows)))
    assert 0.0 < error <= 1e-6 * np.abs(net.weights).sum()


def test_basis_functions_for_every_size_of_exponent() -> None:
    rows = np.sqrt(np.concatenate([np.linspace(0.0, 50.0, 4001), [699.0, 701.0, 1e9]]))[:, None]
    found = basis_functions(rows, np.array([0]), np.zeros((1, 1)), np.ones((1, 1)))[0]
    np.testing.assert_allclose(found[:-2], np.exp(-(rows[:-2, 0] ** 2)), rtol=5e-14)
    assert np.all(found[-2:] < 1e-300)


def test_no_rows_give_no_values() -> None:
    assert network()(np.empty((0, INPUTS))).shape == (0,)


def test_network_without_centres_is_linear() -> None:
    rows = np.random.default_rng(2).normal(size=(300, 2))
    none = np.empty((0, 1))
    values = evaluate_network(rows, np.array([0]), none, none, np.empty(0), np.array([2.0, -1.0]), 0.5)
    np.testing.assert_allclose(values, 0.5 + rows @ [2.0, -1.0], atol=1e-14)


def test_solution_is_ridge_regression_on_the_columns() -> None:
    draw = np.random.default_rng(8)
    rows = draw.normal(size=(400, INPUTS))
    net = network()
    target = written_out(net, rows) + 0.1 * draw.normal(size=len(rows))
    ridge = 0.3
    solution = solve_network(rows, target, net.columns, net.centres, net.widths, ridge)
    exact = solution.network
    columns = np.column_stack(
        [
            np.exp(-(((rows[:, None, net.columns] - exact.centres) / exact.widths) ** 2).sum(axis=2)),
            rows,
            np.ones(len(rows)),
        ]
    )
    penalty = np.diag(np.r_[np.full(CENTRES, ridge), np.zeros(INPUTS + 1)])
    normal = columns.T @ columns + penalty
    weights = np.linalg.solve(normal, columns.T @ target)
    np.testing.assert_allclose(exact.weights, weights[:CENTRES], rtol=1e-6)
    np.testing.assert_allclose([*exact.linear, exact.constant], weights[CENTRES:], rtol=1e-6)
    left = target - columns @ weights
    freedom = len(rows) - np.trace(np.linalg.solve(normal, columns.T @ columns))
    assert solution.noise_std == pytest.approx(np.sqrt(left @ left / freedom), rel=1e-6)
    spread = np.sqrt(np.einsum("ij,ij->i", columns, np.linalg.solve(normal, columns.T).T))
    np.testing.assert_allclose(solution.standard_deviation(rows), spread, rtol=1e-5)


def edge() -> Edge:
    """Inputs 1 and 2 hold a rate and its product with input 0."""
    return Edge(np.array([1, 2]), np.array([-1.0, -2.0]), np.array([1.0, 2.0]))


def test_inside_its_edge_a_network_is_itself() -> None:
    rows = np.random.default_rng(4).uniform(-1.0, 1.0, size=(500, INPUTS))
    np.testing.assert_array_equal(network(edge())(rows), network()(rows))


def test_beyond_its_edge_a_network_is_linear_and_has_no_step_or_kink() -> None:
    net = network(edge())
    factor = np.array([0.999, 1.0, 1.001, 2.0, 3.0, 4.0])
    ray = np.column_stack([np.full(6, 0.4), factor, 0.4 * factor])
    values = net(ray)
    np.testing.assert_allclose(np.diff(values[3:], 2), 0.0, atol=1e-12)
    before, after = (values[1] - values[0]) / 1e-3, (values[2] - values[1]) / 1e-3
    assert after == pytest.approx(before, abs=5e-3)
    assert values[3] - values[1] == pytest.approx(1e3 * (values[2] - values[1]), rel=1e-6)


def test_a_stored_network_goes_on_beyond_its_edge_as_it_did() -> None:
    net, rows = network(edge()), 4.0 * np.random.default_rng(5).normal(size=(300, INPUTS))
    kept = INPUTS, [0, 2], [1, 2]
    again = Network.from_arrays(*kept, net.arrays("float64"), "float64")
    np.testing.assert_array_equal(again(rows), net(rows))
    assert not np.array_equal(again(rows), network()(rows))
    for wrong in ([[0.5, -2.0], [1.0, 2.0]], [[-1.0, -2.0], [1.0, -0.5]]):
        with pytest.raises(InputError, match="'edge' is not a range about 0"):
            Network.from_arrays(*kept, {**net.arrays("float64"), "edge": np.float32(wrong)}, "float64")


def test_rates_are_drawn_in_together_and_into_range() -> None:
    rows = np.random.default_rng(6).normal(size=(2000, INPUTS)) * [1.0, 3.0, 3.0]
    drawn = edge().drawn_in(rows)
    assert np.all(drawn[:, 1:] <= edge().high + 1e-12) and np.all(drawn[:, 1:] >= edge().low - 1e-12)
    np.testing.assert_array_equal(drawn[:, 0], rows[:, 0])
    np.testing.assert_allclose(drawn[:, 1] * rows[:, 2], drawn[:, 2] * rows[:, 1], atol=1e-12)
    untouched = np.setdiff1d(np.arange(len(rows)), edge().crossed(rows))
    np.testing.assert_array_equal(drawn[untouched], rows[untouched])


def test_edge_of_rows_holds_them_and_rest() -> None:
    rows = np.array([[0.1, 0.3], [0.2, 0.7]])
    found = Edge.of(rows, np.array([1]))
    assert found.low[0] == 0.0 and 0.7 <= found.high[0] < 0.7 + 1e-7
    assert len(found.crossed(rows)) == 0
