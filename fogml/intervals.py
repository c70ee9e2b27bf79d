"""What of a normal distribution lies how far off its middle, in standard deviations."""

Z50 = 0.6744897501960817
"""Half-width of the central interval that holds 50 %: the median of sizes."""
Z90 = 1.6448536269514722
"""Half-width that holds 90 %."""
Z95 = 1.959963984540054
"""Half-width that holds 95 %."""
MEDIAN_SIZE, SIGMA_PER_MEDIAN = 0.6745, 1.4826
"""`Z50` and its inverse as robust statistics round them, where four digits tell all that is asked."""
