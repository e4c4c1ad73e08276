"""Runs of two devices with clocks of their own."""
