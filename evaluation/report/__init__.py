"""Test reports: one content from runs and their evaluation, rendered as HTML and as PDF."""

from bufferstand.evaluation.report.reading import Given
from bufferstand.evaluation.report.writing import pdf_available, write_comparison, write_report

__all__ = ["Given", "pdf_available", "write_comparison", "write_report"]
