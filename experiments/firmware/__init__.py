"""Exported C beside the model over days, a year and a million samples with faults."""
