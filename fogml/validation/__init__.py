"""Judging models: figures before and after, noise floors, verdicts, limits, the design index."""
