"""Runs: reading and writing them, what is checked and repaired, facts of the set-up, recordings that ship."""
