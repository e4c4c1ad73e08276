"""Several runs together: the errors that they share, and figures made of several runs."""

from bufferstand.evaluation.across_runs.combine import Figure, Figures, Spread, coverage_factor_95
from bufferstand.evaluation.across_runs.identity import ChannelIdentity, Occasion, identity_of
from bufferstand.evaluation.across_runs.line import Line, fit_line
from bufferstand.evaluation.across_runs.shared import Chain, Owed, Regression, SharedErrors, Source, shared_of

__all__ = [
    "Chain",
    "ChannelIdentity",
    "Figure",
    "Figures",
    "Line",
    "Occasion",
    "Owed",
    "Regression",
    "SharedErrors",
    "Source",
    "Spread",
    "coverage_factor_95",
    "fit_line",
    "identity_of",
    "shared_of",
]
