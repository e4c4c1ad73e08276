"""Frozen facts that the steps of an evaluation hand on. No computation."""
