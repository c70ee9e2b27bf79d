"""The catalogue: one module per effect."""
