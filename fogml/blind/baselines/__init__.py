"""Simpler methods on the same cases: what the diagnosis must be better than."""
