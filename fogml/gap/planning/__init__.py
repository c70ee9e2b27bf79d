"""Programmes that tell causes or constants apart."""
