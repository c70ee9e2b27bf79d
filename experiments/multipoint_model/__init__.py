"""The multi-point temperature paper, checked."""
