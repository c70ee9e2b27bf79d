"""Forms of effects of the third reality, by subject."""
