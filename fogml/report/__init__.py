"""Figures, self-contained HTML pages, certificates and spreadsheets."""

from fogml.report.train_page import train_page

__all__ = ["train_page"]
