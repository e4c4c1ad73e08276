"""Test reports: one content from runs and their evaluation, rendered as HTML and as PDF."""

from evaluation.report.writing import pdf_available, write_report

__all__ = ["pdf_available", "write_report"]
