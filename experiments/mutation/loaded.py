"""What tests load of other makers, and one thread for it."""

import os
from contextlib import suppress
from importlib import import_module

os.environ["OMP_NUM_THREADS"] = "1"
for _name in (
    "click.testing",
    "h5py",
    "numba",
    "onnx",
    "onnxruntime",
    "openpyxl",
    "optuna",
    "pandas",
    "plotly.graph_objects",
    "plotly.subplots",
    "pyarrow.parquet",
    "pydantic",
    "pytest",
    "rich.table",
    "safetensors.numpy",
    "scipy.integrate",
    "scipy.interpolate",
    "scipy.io",
    "scipy.ndimage",
    "scipy.optimize",
    "scipy.signal",
    "scipy.stats",
    "sklearn.compose",
    "sklearn.ensemble",
    "sklearn.gaussian_process",
    "sklearn.linear_model",
    "sklearn.pipeline",
    "sklearn.utils.estimator_checks",
    "skl2onnx",
    "skops.io",
    "torch",
    "xlsxwriter",
    "yaml",
):
    with suppress(ImportError):
        import_module(_name)
