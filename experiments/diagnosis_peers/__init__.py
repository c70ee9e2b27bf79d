"""Ways to diagnose beside each other, on the same blind cases."""
