"""Which runs of a specimen are its conformity test, and which only state characteristics."""

from bufferstand.evaluation.conformity.candidates import candidate_of, standing_of
from bufferstand.evaluation.conformity.purposes import (
    CHARACTERISATION,
    CONFORMITY,
    Candidate,
    Decided,
    Purpose,
    Statement,
    decide_purposes,
)

__all__ = [
    "CHARACTERISATION",
    "CONFORMITY",
    "Candidate",
    "Decided",
    "Purpose",
    "Statement",
    "candidate_of",
    "decide_purposes",
    "standing_of",
]
