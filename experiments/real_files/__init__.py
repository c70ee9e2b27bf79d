"""Real files and ordinary units: what comes out of them."""
