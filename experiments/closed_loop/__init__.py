"""From a found cause to a compensated gyro, on fresh units."""
