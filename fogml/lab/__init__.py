"""The laboratory's procedures: scale factor and misalignment, north seeking, what a drift costs in navigation."""
