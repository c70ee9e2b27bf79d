"""Scale factor and misalignment: the four-state procedure against the classical test and one state alone."""
