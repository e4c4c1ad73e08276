"""What a record holds besides: holds, settling, cumulated energy; and the runs of a specimen in order."""

from evaluation.history.across import across_entries
from evaluation.history.facts import RunHistory
from evaluation.history.of_run import history_of

__all__ = ["RunHistory", "across_entries", "history_of"]
