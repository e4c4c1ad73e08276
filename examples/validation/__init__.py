"""Other programs on the standard data sets of ``bufferstand validate`` (docs/validation.md)."""
