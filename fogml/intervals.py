"""Half-widths of a normal distribution's central intervals, in standard deviations."""

Z90 = 1.6448536269514722
"""Half-width that holds 90 %."""
Z95 = 1.959963984540054
"""Half-width that holds 95 %."""
