"""The diagnosis of the gap between the twin and a recording."""
