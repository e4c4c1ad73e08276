"""Identification of a spring model from recorded runs (docs/identification.md)."""
