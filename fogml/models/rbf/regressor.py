"""The RBF network as a scikit-learn regressor."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from fogml.arrays import FloatArray, IndexArray
from fogml.errors import InputError
from fogml.models.parameters import Device, WholeNumbers, check_parameters
from fogml.models.rbf.blocks import Frame, average_in_blocks
from fogml.models.rbf.fitted import NetworkRegressor, SavedFit
from fogml.models.rbf.rates import RATES_THAT_TELL, Edge, followed_columns, restrained_inputs, training_rates
from fogml.models.rbf.search import COARSE_ROWS, COARSE_ROWS_PER_CENTRE, Search, SearchSettings
from fogml.models.rbf.tuning import TuningSettings
from fogml.models.scikit_learn import Interval, StrOptions, check_is_fitted, validate_data

if TYPE_CHECKING:
    from fogml.features.features import Features


PRUNE_NATS = 1.1
SIZES = (16, 32, 64)
"""Numbers of centres among which ``centres="evidence"`` chooses."""


class _Fitted(SavedFit):
    sizes_tried_: dict[str, float]
    independent_share_: float


class RBFRegressor(NetworkRegressor):
    """RBF network with own width per centre and input, and a linear part beside it.

    ``y = w0 + a . x + sum_j w_j exp(-|(x - c_j) / s_j|^2)``, the division input by input. Far
    beyond the training rows only the linear part is left.

    Rows are taken to be in order of time. Centres and widths are tuned on averages of blocks of
    time, by L-BFGS on the log evidence with the output weights solved exactly at every step
    (variable projection): starts and sizes race on about a thousand coarse averages, the best network
    is refined on finer ones. The output weights are then solved for on all rows by QR in float64.
    The same rows, parameters and machine give the same network.

    Parameters
    ----------
    centres
        Greatest number of centres; ``"evidence"`` chooses among `SIZES`, a sequence among its numbers.
        Fewer are used where there are fewer than three averaged rows to each, and where fewer are as good.
    centre_choice
        Where tuning begins: ``"kmeans"``, or ``"ols"`` for orthogonal least squares.
    tune
        Whether centres and own widths are tuned. Shared widths always are.
    objective
        ``"evidence"``, or ``"validation"``: plain variable projection on four fifths of the blocks
        of time, stopped when the error on the last fifth no longer falls.
    ridge
        ``"evidence"`` learns it; or a number, the ratio of the noise variance of an averaged row
        to the variance of an output weight. With ``objective="validation"``, ``"evidence"`` stands
        for 1e-6.
    network_inputs
        Indices of the inputs that the network sees; the others enter the linear part only. None: all.
    wide_inputs
        Indices of the inputs that hold a rate, in which the target bends little: widths along them
        also start e^3 times wider, and beyond the training rows the network goes on linearly along
        its slope there. None: starts are tried input by input.
    average_rows
        Rows are averaged in blocks down to about this number for the network that is kept.
    prune
        By how much the log evidence of a smaller network may be less for it to be taken as good [nat], and so
        to be kept: of the sizes tried the smallest such, and of its centres those without which it is not.
        Log 3, as an evidence smaller by less is not worth a mention (Jeffreys; Kass & Raftery, J. Am. Stat.
        Assoc. 90 (1995) 773). 0 keeps every centre. Only with ``objective="evidence"``.
    width_prior
        Standard deviation of the log-normal prior of own widths about the shared ones.
    seed
        Seed of k-means.
    threads
        Threads of prediction; by default all cores. Tuning takes one.
    device, dtype
        Where torch tunes (``"cpu"``, ``"cuda"``), and in ``"float64"`` or ``"float32"``.

    Attributes
    ----------
    sizes_tried_ : dict
        Objective, less is better, by number of centres.
    independent_share_ : float
        Share of the averaged rows that counted as independent: one over the integrated
        autocorrelation of what the smallest network left.

    Further attributes are those of `NetworkRegressor`.
    """

    _fitted = _Fitted
    _parameter_constraints: ClassVar[dict[str, Any]] = {
        "centres": [
            StrOptions({"evidence"}),
            Interval(Integral, 0, None, closed="left"),
            WholeNumbers(0, few=1),
        ],
        "centre_choice": [StrOptions({"kmeans", "ols"})],
        "tune": ["boolean"],
        "objective": [StrOptions({"evidence", "validation"})],
        "ridge": [StrOptions({"evidence"}), Interval(Real, 0.0, None, closed="left")],
        "network_inputs": [None, WholeNumbers(0)],
        "wide_inputs": [None, WholeNumbers(0)],
        "average_rows": [Interval(Integral, 10, None, closed="left")],
        "prune": [Interval(Real, 0.0, None, closed="left")],
        "width_prior": [Interval(Real, 0.0, None, closed="neither")],
        "device": [Device()],
        "dtype": [StrOptions({"float64", "float32"})],
        **NetworkRegressor._parameter_constraints,
    }

    def __init__(
        self,
        centres: int | Literal["evidence"] | Sequence[int] = "evidence",
        *,
        centre_choice: Literal["kmeans", "ols"] = "kmeans",
        tune: bool = True,
        objective: Literal["evidence", "validation"] = "evidence",
        ridge: float | Literal["evidence"] = "evidence",
        network_inputs: Sequence[int] | None = None,
        wide_inputs: Sequence[int] | None = None,
        average_rows: int = 4000,
        prune: float = PRUNE_NATS,
        width_prior: float = 0.5,
        seed: int = 0,
        threads: int | None = None,
        device: str = "cpu",
        dtype: Literal["float64", "float32"] = "float64",
    ) -> None:
        self.centres = centres
        self.centre_choice = centre_choice
        self.tune = tune
        self.objective = objective
        self.ridge = ridge
        self.network_inputs = network_inputs
        self.wide_inputs = wide_inputs
        self.average_rows = average_rows
        self.prune = prune
        self.width_prior = width_prior
        self.seed = seed
        self.threads = threads
        self.device = device
        self.dtype = dtype

    def for_features(self, features: Features, atom_values: FloatArray) -> RBFRegressor:
        """A regressor of the same parameters that heeds what the training rows tell of rates.

        With fewer than three distinct rates of temperature, whatever holds a rate enters linearly.

        Parameters
        ----------
        features
            Features whose columns the regressor will get.
        atom_values
            Values of their atoms in the training rows, shape (n, a).
        """
        parameters = self.get_params()
        if self.wide_inputs is None:
            parameters["wide_inputs"] = followed_columns(features).tolist()
        told: list[str] = []
        if self.network_inputs is None:
            seen = restrained_inputs(features, atom_values)
            if len(seen) < len(features):
                parameters["network_inputs"] = seen.tolist()
                names = features.names()
                network = ", ".join(names[i] for i in seen) or "no input"
                linear = ", ".join(name for i, name in enumerate(names) if i not in seen)
                told.append(
                    "distinct rates of temperature in the training runs: "
                    f"{training_rates(features, atom_values)}, where {RATES_THAT_TELL} are needed to tell "
                    f"how the drift bends with the rate. So the network is of {network} alone, and "
                    f"{linear} linear beside it"
                )
        regressor = RBFRegressor(**parameters)
        regressor._told = told
        return regressor

    def fit(
        self, X: ArrayLike, y: ArrayLike, *, groups: ArrayLike | None = None, time: ArrayLike | None = None
    ) -> Self:
        """Fit to rows in time order.

        Parameters
        ----------
        X
            Inputs, shape (n, k).
        y
            Values, shape (n,).
        groups
            Labels of the runs that rows come from, shape (n,); by default one run.
        time
            Times of the rows [s], shape (n,); by default rows follow each other evenly.
        """
        check_parameters(type(self), self.get_params(deep=False))
        inputs, target = validate_data(self, X, y, dtype=np.float64, y_numeric=True, ensure_min_samples=2)
        inputs, target = np.ascontiguousarray(inputs), np.asarray(target, dtype=np.float64)
        seen = self._seen(inputs.shape[1])
        settings = self._settings()
        rows = average_in_blocks(inputs, target, self.average_rows, groups, time)
        coarse = max(COARSE_ROWS, COARSE_ROWS_PER_CENTRE * max(settings.sizes))
        tried = average_in_blocks(inputs, target, coarse, groups, time) if coarse < len(rows.target) else rows
        frame = Frame.of(inputs, target)
        found = Search(rows, tried, frame, seen, settings).run()
        self.sizes_tried_ = {str(size): value for size, value in found.tried.items()}
        self.independent_share_ = found.share
        self.ridge_ = float(np.exp(found.shape.log_ridge)) * rows.per_row
        self._solve(
            inputs,
            target,
            seen,
            frame.shift[seen] + frame.scale[seen] * found.shape.centres,
            frame.scale[seen] * np.exp(found.shape.log_widths),
            self._edge(inputs, seen),
            (rows.inputs, rows.target),
        )
        self.notes_ = list(getattr(self, "_told", ()))
        if not rows.in_time:
            self.notes_.append(
                "rows near in the inputs were averaged for tuning: rows are not in order of time, or the "
                "run is so long that the inputs move within one of the blocks to average in"
            )
        return self

    @property
    def linear_beyond(self) -> bool:
        """Whether the network goes on linearly in rates beyond its training rows."""
        check_is_fitted(self)
        return self.wide_inputs is not None or len(self.network_.columns) == 0

    def describe(self) -> dict[str, Any]:
        """What reports say of the network."""
        check_is_fitted(self)
        return {
            "centres": len(self.network_.weights),
            "network_inputs": self.network_.columns.tolist(),
            "objective": self.objective,
            "sizes_tried": self.sizes_tried_,
            "independent_share": self.independent_share_,
            "ridge": self.ridge_,
            "noise_std": self.noise_std_,
            "weights_dtype": self.weights_dtype_,
            "rounding_error": self.rounding_error_,
        }

    def _seen(self, width: int) -> IndexArray:
        """Indices of the network's inputs."""
        if self.network_inputs is None:
            return np.arange(width, dtype=np.intp)
        seen = np.unique(np.asarray(self.network_inputs, dtype=np.intp))
        if seen.size and (seen[0] < 0 or seen[-1] >= width):
            raise InputError(f"network_inputs {list(self.network_inputs)}: there are inputs 0 to {width - 1}")
        return seen

    def _edge(self, inputs: FloatArray, seen: IndexArray) -> Edge:
        """The trained range of the rates; none where the network sees none of them, being linear there."""
        wide = np.array([] if self.wide_inputs is None else self.wide_inputs, dtype=np.intp)
        return Edge.of(inputs, wide) if np.isin(seen, wide).any() else Edge.none()

    def _settings(self) -> SearchSettings:
        if isinstance(self.centres, str):
            sizes: tuple[int, ...] = SIZES
        elif isinstance(self.centres, Sequence):
            sizes = tuple(sorted(int(size) for size in self.centres))
        else:
            sizes = (int(self.centres),)
        learned = isinstance(self.ridge, str)
        return SearchSettings(
            sizes=sizes,
            centre_choice=self.centre_choice,
            tune=self.tune,
            evidence=self.objective == "evidence",
            tuning=TuningSettings(
                width_prior=self.width_prior,
                log_ridge=None if learned else float(np.log(max(float(self.ridge), 1e-300))),
            ),
            wide_inputs=None if self.wide_inputs is None else tuple(int(i) for i in self.wide_inputs),
            seed=self.seed,
            device=self.device,
            dtype=self.dtype,
            worth=float(self.prune),
        )
