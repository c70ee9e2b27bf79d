"""What scikit-learn asks of features as a transformer of one parameter, their text."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fogml.errors import InputError


class Transformer:
    """A transformer whose only parameter is its text."""

    text: str

    def names(self) -> list[str]:
        """Names of the columns."""
        raise NotImplementedError

    def get_feature_names_out(self, input_features: object = None) -> NDArray[Any]:
        """`names` as an array, the way scikit-learn asks for them."""
        return np.array(self.names(), dtype=object)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Parameters, as in scikit-learn."""
        return {"text": self.text}

    def set_params(self, **params: Any) -> Self:
        """Set parameters, as in scikit-learn; what was learned is dropped."""
        for name, value in params.items():
            if name != "text":
                raise InputError(f"features: no parameter '{name}'; the only one is text")
            self.text = value
        return self

    def __sklearn_tags__(self) -> Any:
        from sklearn.utils import Tags, TargetTags, TransformerTags

        return Tags(
            estimator_type=None, target_tags=TargetTags(required=False), transformer_tags=TransformerTags()
        )

    def __sklearn_is_fitted__(self) -> bool:
        return True
