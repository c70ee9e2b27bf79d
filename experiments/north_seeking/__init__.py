"""North seeking at start-up: the patent's scheme and claim against others, with the twin as the gyro."""
