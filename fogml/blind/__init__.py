"""The check on withheld effects: blind cases, their diagnosis and its score."""
