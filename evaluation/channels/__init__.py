"""Channels with their own instants: interpolating the force at those of the stroke; invalid readings."""

__all__ = ["between", "bring", "joined", "pieces", "rates", "rows", "sensors"]
