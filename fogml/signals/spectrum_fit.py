"""Noise terms of greatest likelihood for a spectrum, behind an output filter.

Whittle's likelihood: rows of a spectrum are chi-square about the model's density. Constants of the columns
are integrated out of the lowest rows (restricted likelihood): they cost only their degrees of freedom.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fogml.arrays import BoolArray, FloatArray
from fogml.signals.noise_spectrum import Spectrum
from fogml.signals.output_filters import AFTER, NO_FILTER, OutputFilter, SpectrumTerms, term_shapes

_TOLERANCE = 1e-7
_ROUNDED = 1e-13
"""Least eigenvalue of an information of diagonal 1: below it rounding makes what there is."""


@dataclass(frozen=True)
class SpectrumFit:
    """A fitted model.

    Attributes
    ----------
    terms, filter, log_corner
        The model; the corner as in `OutputFilter.response`.
    coefficients
        Squares: N^2 [(deg/h)^2 s], B^2 [(deg/h)^2], K^2 [(deg/h)^2/s], Q^2 [(deg/h s)^2], the variance of G
        [(deg/h)^2], W^2 as N^2; in the order of the names.
    density
        Of the model at each row [(deg/h)^2/Hz].
    loss
        Negative logarithm of the likelihood, up to a constant of the data.
    constants, covariance
        Of the columns, by generalised least squares.
    used
        Rows that the fit stands on.
    """

    terms: SpectrumTerms
    filter: OutputFilter
    log_corner: float
    coefficients: FloatArray
    density: FloatArray
    loss: float
    constants: FloatArray
    covariance: FloatArray
    used: BoolArray

    def __getitem__(self, name: str) -> float:
        """The coefficient of a term, 0 if the model has none."""
        names = self.terms.names
        return float(self.coefficients[names.index(name)]) if name in names else 0.0

    @property
    def free(self) -> int:
        """Number of fitted constants: terms in use and the corner."""
        return int(
            np.count_nonzero(self.coefficients) + self.filter.free + (self.terms.correlation_s is not None)
        )


class _Told(NamedTuple):
    """What the data say of a density.

    Attributes
    ----------
    loss
        As of a fit.
    power
        Of the rows, with what the columns take.
    constants, covariance
        As of a fit.
    taken
        Orthonormal basis of the columns over the root of the density, shape (lowest rows, columns).
    """

    loss: float
    power: FloatArray
    constants: FloatArray
    covariance: FloatArray
    taken: FloatArray


class SpectrumModel:
    """A family of densities, of terms behind a filter, at the rows of a spectrum that count; all if None."""

    def __init__(
        self,
        spectrum: Spectrum,
        terms: SpectrumTerms,
        output_filter: OutputFilter = NO_FILTER,
        used: BoolArray | None = None,
    ) -> None:
        self.spectrum, self.terms, self.filter = spectrum, terms, output_filter
        self.used = np.ones(len(spectrum.power), dtype=np.bool_) if used is None else used
        self._single = len(spectrum.values)
        self._basis, self._back = spectrum.basis
        low = self.used[: self._single]
        if not low.all() and self._basis.shape[1]:
            # Columns that lie in rows that are not used are told by none.
            _, sizes, turned = np.linalg.svd(self._basis * low[:, None], full_matrices=False)
            shown = turned[sizes**2 > _ROUNDED].T
            self._basis, self._back = self._basis @ shown, self._back @ shown
        self._cycles = spectrum.frequency_hz * spectrum.sample_s
        # A filter that lets nothing of the whole spectrum pass is told from no other.
        self._lowest_corner = float(np.log(np.pi * np.min(self._cycles, initial=0.5)))
        shapes = term_shapes(spectrum.frequency_hz, spectrum.sample_s, terms, spectrum.stretch_s[:, None])
        self._before = [i for i, name in enumerate(terms.names) if name not in AFTER]
        self._ends = [i for i, name in enumerate(terms.names) if name == "E"]
        self._shapes, self._end_shapes = shapes[..., self._before], shapes[..., self._ends]
        self._design = shapes.mean(axis=1)
        freedom = spectrum.count
        if output_filter.kind == "mean":
            # A row with a zero of the response stands on fewer coefficients.
            gain = output_filter.response(self._cycles, 0.0)[0]
            freedom = freedom * gain.mean(axis=1) ** 2 / np.mean(gain**2, axis=1)
        self.freedom = np.where(self.used, freedom, 0.0)

    def design(self, log_corner: float) -> tuple[FloatArray, FloatArray | None]:
        """Density of each term of coefficient 1, shape (rows, terms); slopes of those over the corner."""
        if self.filter.kind == "none":
            return self._design, None
        gain, slope = self.filter.response(self._cycles, log_corner)
        design = self._design.copy()
        design[:, self._before] = _row_means(self._shapes, gain)
        # Only where the filter lets next to nothing pass do the ends count.
        design[:, self._ends] = _row_means(self._end_shapes, (1.0 - gain) ** 2)
        if not self.filter.free:
            return design, None
        slopes = np.zeros_like(design)
        slopes[:, self._before] = _row_means(self._shapes, slope)
        return design, slopes

    def fit(
        self,
        start: SpectrumFit | None = None,
        log_corner: float = 0.0,
        held: tuple[int, float] | None = None,
        excess: float = 0.0,
        rounds: int = 60,
    ) -> SpectrumFit:
        """The model of greatest likelihood, by Fisher scoring with coefficients that are not negative.

        Parameters
        ----------
        start
            A fit of this family to begin with.
        log_corner
            Where there is none: the corner to begin with.
        held
            A term that is held at a coefficient.
        excess
            Variance of the rows' relative errors beyond what chance explains.
        rounds
            At most.
        """
        freedom = self.freedom / (1.0 + 0.5 * self.freedom * excess)
        corner = max(start.log_corner if start is not None else log_corner, self._lowest_corner)
        design, slopes = self.design(corner)
        terms = design.shape[1]
        free = [j for j in range(terms) if held is None or j != held[0]]
        coefficients = np.zeros(terms) if start is None else start.coefficients.copy()
        if held is not None:
            coefficients[held[0]] = held[1]
        density = design @ coefficients
        begun = start is not None and bool(np.all(density[self.used] > 0.0))
        if not begun:
            density = self._smoothed()
        told = self._told(density, freedom)
        loss = told.loss if begun else np.inf
        for _ in range(rounds):
            columns = design[:, free]
            if slopes is not None:
                along = slopes @ coefficients if np.any(coefficients) else np.zeros(len(density))
                columns = np.column_stack((columns, along, -along))
            given = 0.0 if held is None else design[:, held[0]] * held[1]
            found = self._scored(columns, given, density, told, freedom)
            proposed = coefficients.copy()
            proposed[free] = found[: len(free)]
            moved = 0.0 if slopes is None else float(np.clip(found[-2] - found[-1], -1.0, 1.0))
            step, better = 1.0, False
            while step > 1e-3:
                new_corner = max(corner + step * moved, self._lowest_corner)
                new_design, new_slopes = self.design(new_corner) if slopes is not None else (design, None)
                mixed = proposed if not np.isfinite(loss) else coefficients + step * (proposed - coefficients)
                new_density = new_design @ mixed
                if np.all(new_density[self.used] > 0.0):
                    new_told = self._told(new_density, freedom)
                    if new_told.loss <= loss:
                        better = True
                        break
                step *= 0.5
            if not better:
                break
            gained = loss - new_told.loss
            corner, design, slopes, coefficients = new_corner, new_design, new_slopes, mixed
            density, told, loss = new_density, new_told, new_told.loss
            if gained <= _TOLERANCE * (1.0 + abs(loss)):
                break
        return SpectrumFit(
            self.terms, self.filter, corner, coefficients, density, float(loss), *told[2:4], self.used
        )

    def _scored(
        self,
        columns: FloatArray,
        given: FloatArray | float,
        density: FloatArray,
        told: _Told,
        freedom: FloatArray,
    ) -> FloatArray:
        """Coefficients of a step of Fisher scoring, none negative, beside a density that is given.

        The information is that of the restricted likelihood, half the trace of ``P D P D``: what constants
        of columns take of a row tells nothing of the noise.
        """
        from scipy.optimize import nnls

        weight = np.sqrt(0.5 * freedom) / np.where(self.used, density, 1.0)
        scaled = columns * weight[:, None]
        norms = np.linalg.norm(scaled, axis=0)
        norms[norms == 0.0] = 1.0
        scaled /= norms
        both = np.column_stack((scaled, weight * (density - given)))
        moments = self._moments(scaled, both, told.taken)
        information = moments[:, :-1]
        told_by = np.diag(information) > _ROUNDED
        size = np.where(told_by, np.sqrt(np.maximum(np.diag(information), _ROUNDED)), np.inf)
        values, vectors = np.linalg.eigh(information / np.outer(size, size))
        pull = (moments[:, -1] + scaled.T @ (weight * (told.power - density))) / size
        root = np.sqrt(np.maximum(values, _ROUNDED))
        return np.asarray(nnls(root[:, None] * vectors.T, vectors.T @ pull / root)[0] / size / norms)

    def _moments(self, scaled: FloatArray, others: FloatArray, taken: FloatArray) -> FloatArray:
        """Products of columns over the density with others, less what constants of the spectrum's take."""
        low, left = slice(self._single), np.ones(len(scaled))
        left[low] -= 2.0 * np.sum(taken**2, axis=1)
        pairs = (taken[:, :, None] * taken[:, None, :]).reshape(self._single, -1)
        beside = (pairs.T @ scaled[low]).T @ (pairs.T @ others[low])
        return np.asarray(scaled.T @ (left[:, None] * others) + beside)

    def information(self, fit: SpectrumFit, excess: float = 0.0) -> FloatArray:
        """Fisher's information of a fit's coefficients and, last, its corner if that is free."""
        freedom = self.freedom / (1.0 + 0.5 * self.freedom * excess)
        columns, slopes = self.design(fit.log_corner)
        if slopes is not None:
            columns = np.column_stack((columns, slopes @ fit.coefficients))
        scaled = columns * (np.sqrt(0.5 * freedom) / np.where(self.used, fit.density, 1.0))[:, None]
        return self._moments(scaled, scaled, self._told(fit.density, freedom).taken)

    def scanned(self, corners: FloatArray) -> SpectrumFit:
        """The fit that goes on from the corner which leads the furthest in a few rounds."""
        fits = [self.fit(log_corner=float(c), rounds=8 if len(corners) > 1 else 60) for c in corners]
        best = min(fits, key=lambda fit: fit.loss)
        return self.fit(best) if len(corners) > 1 and np.isfinite(best.loss) else best

    def _smoothed(self) -> FloatArray:
        """Power of the rows about each, for first weights: the more of it, the less of a row columns take."""
        frequency = np.log2(self.spectrum.frequency_hz[:, 0])
        order = np.argsort(frequency, kind="stable")
        rising = frequency[order]
        low = np.searchsorted(rising, rising - 0.5)
        high = np.searchsorted(rising, rising + 0.5, side="right")
        left = np.ones(len(order))
        left[: self._single] -= np.sum(self._basis**2, axis=1)
        freedom = self.freedom[order]
        sums = np.concatenate(([0.0], np.cumsum(freedom * left[order])))
        means = np.concatenate(([0.0], np.cumsum(freedom * self.spectrum.power[order])))
        counted = np.maximum(sums[high] - sums[low], 1e-9)
        # A tenth of a degree of freedom suffices for what only chooses where the fit begins.
        told = counted >= min(0.1, float(counted.max()))
        smooth = np.empty(len(order))
        smooth[order] = np.interp(rising, rising[told], (means[high] - means[low])[told] / counted[told])
        least = max(float(smooth.max()) * 1e-30, 1e-300)
        return np.maximum(smooth, least)

    def _told(self, density: FloatArray, freedom: FloatArray) -> _Told:
        """What the data say of a density."""
        s, power = self.spectrum, self.spectrum.power
        count = s.columns.shape[1]
        constants, covariance, taken = np.zeros(count), np.zeros((count, count)), np.empty((self._single, 0))
        loss = 0.0
        if self._basis.shape[1]:
            weight = (self.used / np.where(self.used, density, 1.0))[: self._single]
            weighed = self._basis * weight[:, None]
            information = weighed.T @ self._basis
            size = np.sqrt(np.maximum(np.diag(information), 1e-300))
            values, vectors = np.linalg.eigh(information / np.outer(size, size))
            values = np.maximum(values, _ROUNDED)
            root = (vectors / np.sqrt(values)) / size[:, None]
            of_basis = root @ (root.T @ (weighed.T @ s.values))
            constants, covariance = self._back @ of_basis, self._back @ root @ root.T @ self._back.T
            rest = s.values - self._basis @ of_basis
            along = self._basis @ root
            taken = along * np.sqrt(weight)[:, None]
            power = power.copy()
            power[: self._single] = rest**2 + np.sum(along**2, axis=1)
            square = rest**2
            loss += 0.5 * float(np.sum(np.log(values)) + 2.0 * np.sum(np.log(size)))
        else:
            square = s.values**2
        low = self.used[: self._single]
        with np.errstate(divide="ignore"):
            alone = density[: self._single][low]
            loss += 0.5 * float(np.sum(np.log(alone) + square[low] / alone))
            high = self.used.copy()
            high[: self._single] = False
            ratio = np.maximum(s.power[high], 1e-300) / density[high]
            loss += 0.5 * float(freedom[high] @ (ratio - 1.0 - np.log(ratio)))
        return _Told(loss, power, constants, covariance, taken)


def _row_means(shapes: FloatArray, gain: FloatArray) -> FloatArray:
    """Means over the frequencies of each row of shapes behind a gain, shape (rows, terms)."""
    return np.asarray(np.einsum("rkt,rk->rt", shapes, gain)) / max(gain.shape[1], 1)
