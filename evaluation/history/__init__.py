"""Holds, settling and cumulated energy of a run; and the runs of a specimen in order."""

from bufferstand.evaluation.history.across import before_after_entries, proof_load_entries
from bufferstand.evaluation.history.facts import RunHistory
from bufferstand.evaluation.history.of_run import history_of

__all__ = ["RunHistory", "before_after_entries", "history_of", "proof_load_entries"]
