"""Bounds of every number that somebody writes, and what a stand cannot guard."""
