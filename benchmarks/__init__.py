"""Measurements of speed: ratios within one process, never a test."""
