"""Models of the multi-point paper, in sample and at other ramp rates, with the twin as the world."""
