"""A heat network as independent decaying modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fogml.errors import InputError
from fogml.runs.run import FloatArray


@dataclass(frozen=True, eq=False)
class ModalSystem:
    """Modes of ``C dT/dt = -K T + B T_boundary + e P``.

    Attributes
    ----------
    rates
        Decay rates [1/s], shape (m,), all positive.
    gains
        From boundary temperatures [degC] to the modes, shape (m, k).
    source_gains
        From power [W] to the modes, shape (m,).
    to_modes, to_states
        From node temperatures to modes and back, shape (m, m).
    """

    rates: FloatArray
    gains: FloatArray
    source_gains: FloatArray
    to_modes: FloatArray
    to_states: FloatArray

    @classmethod
    def of(
        cls, capacity: FloatArray, conduction: FloatArray, boundary: FloatArray, heated: FloatArray
    ) -> ModalSystem:
        """The modes of a network.

        Parameters
        ----------
        capacity
            C [J/K], shape (m,).
        conduction
            K [W/K], symmetric, shape (m, m).
        boundary
            B [W/K], shape (m, k).
        heated
            e, shape (m,).

        Notes
        -----
        ``C^-1/2 K C^-1/2`` is symmetric, so all rates are real.
        """
        root = np.sqrt(capacity)
        rates, vectors = np.linalg.eigh(conduction / np.outer(root, root))
        if len(rates) and not rates[0] > 1e-12 * rates[-1]:
            raise InputError(
                "thermal plant: a node exchanges heat with no given temperature; link it, or leave it out"
            )
        to_modes = np.ascontiguousarray((vectors * root[:, None]).T)
        to_states = np.ascontiguousarray(vectors / root[:, None])
        return cls(rates, to_states.T @ boundary, to_states.T @ heated, to_modes, to_states)
