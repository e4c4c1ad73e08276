"""Worked examples; each runs as ``python -m examples.<name>`` and as a test."""
