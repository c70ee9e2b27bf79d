"""The catalogue: each file holds the effects of one subject."""
