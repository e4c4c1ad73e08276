"""Test reports: one content from runs and their evaluation, rendered as HTML and as PDF."""
