"""Figures of merit of a diagnosis over many blind cases."""
