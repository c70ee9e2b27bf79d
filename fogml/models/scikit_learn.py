"""What models take from scikit-learn.

It loads `scipy.stats` and pandas for functions of which nothing here calls any: most of its own time.
"""

from fogml.put_off import put_off

with put_off("scipy.stats", "pandas"):
    from sklearn.base import BaseEstimator, RegressorMixin, clone
    from sklearn.exceptions import NotFittedError
    from sklearn.utils._param_validation import Interval, StrOptions, make_constraint
    from sklearn.utils.validation import check_is_fitted, validate_data

__all__ = [
    "BaseEstimator",
    "Interval",
    "NotFittedError",
    "RegressorMixin",
    "StrOptions",
    "check_is_fitted",
    "clone",
    "make_constraint",
    "validate_data",
]
