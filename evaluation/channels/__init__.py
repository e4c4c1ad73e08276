"""Each channel on its own instants: bringing the force to those of the stroke, and what is no reading."""

__all__ = ["between", "bring", "joined", "pieces", "rates", "rows", "sensors"]
