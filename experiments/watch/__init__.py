"""Key ratios and counts of work, release by release: none of them by the clock."""
