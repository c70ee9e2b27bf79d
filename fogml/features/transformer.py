"""What scikit-learn asks of features as a transformer of one parameter, their text."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from fogml.arrays import FloatArray
from fogml.errors import InputError

_CONTAINERS = ("default", "pandas", "polars")


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

    def set_output(self, *, transform: Literal["default", "pandas", "polars"] | None = None) -> Self:
        """What `transform` gives, as in scikit-learn: an array, or a frame with `names` over its columns.

        None leaves it; where nothing is set, it is as ``sklearn.set_config(transform_output=...)`` says.
        """
        if transform not in (None, *_CONTAINERS):
            raise InputError(f"features: output as {transform!r}; known are {', '.join(_CONTAINERS)}")
        if transform is not None:
            # Under this name scikit-learn's clone takes it along.
            self._sklearn_output_config = {"transform": transform}
        return self

    def _contained(self, columns: FloatArray) -> Any:
        """Columns in what was asked for with `set_output`."""
        known = getattr(self, "_sklearn_output_config", {})
        general = sys.modules["sklearn"].get_config() if "sklearn" in sys.modules else {}
        container = known.get("transform", general.get("transform_output", "default"))
        if container == "default":
            return columns
        try:
            library = import_module(container)
        except ImportError:
            raise InputError(f"features: output as {container} needs {container}; install it") from None
        return library.DataFrame(dict(zip(self.names(), columns.T, strict=True)))

    def __sklearn_tags__(self) -> Any:
        from sklearn.utils import Tags, TargetTags, TransformerTags

        return Tags(
            estimator_type=None, target_tags=TargetTags(required=False), transformer_tags=TransformerTags()
        )

    def __sklearn_is_fitted__(self) -> bool:
        return True
