"""Runs of stands whose reversals take time, against the stand's own truth."""
