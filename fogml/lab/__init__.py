"""The laboratory's procedures: misalignment, north seeking, what a drift costs in navigation."""
