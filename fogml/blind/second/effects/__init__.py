"""Forms of effects of the second reality, by subject."""
