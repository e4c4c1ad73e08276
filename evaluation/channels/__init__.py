"""Each channel on its own instants: bringing the force to those of the stroke."""

__all__ = ["bring", "joined", "rows"]
