"""Compact weights: a fitted model as C99, ONNX, JSON with safetensors, or MATLAB file, checked before it is written."""
