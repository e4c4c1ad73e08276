"""Gaps of a record: which steps hide something, which are rest, and what the others may change."""
