"""The simulator: programmes, a thermal plant, a gyro, and the catalogue of effects."""
