"""Holds, settling and cumulated energy of a run; and the runs of a specimen in order."""
