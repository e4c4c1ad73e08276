"""Temperatures of cycles: what the sensors show, and whether their readings cover a cycle."""
