"""Numerics with no gyro in them: Allan deviation, windows, memories, noise models, whitening."""
