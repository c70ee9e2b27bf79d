"""Compact weights: a fitted model as C99, ONNX, JSON or MATLAB file, checked before it is written."""
