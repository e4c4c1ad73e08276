"""The kind “registers”: a controller whose register profile describes it, without code."""
