"""Drift models behind one interface: `fogml.models.base.DriftModel`, by name from `fogml.models.names`."""
