"""Figures, self-contained HTML pages, certificates and spreadsheets."""

from fogml.report.blind_page import blind_page
from fogml.report.certificate import certificate
from fogml.report.compare_page import compare_page
from fogml.report.gap_page import gap_page
from fogml.report.index_page import index_page
from fogml.report.inspect_page import inspect_page
from fogml.report.misalignment_page import misalignment_page
from fogml.report.noise_page import noise_page
from fogml.report.north_page import north_page
from fogml.report.spreadsheet import spreadsheet
from fogml.report.train_page import train_page

__all__ = [
    "blind_page",
    "certificate",
    "compare_page",
    "gap_page",
    "index_page",
    "inspect_page",
    "misalignment_page",
    "noise_page",
    "north_page",
    "spreadsheet",
    "train_page",
]
