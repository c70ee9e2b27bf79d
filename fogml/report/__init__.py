"""Figures, self-contained HTML pages, certificates and spreadsheets."""
