"""The words for names that files and documents use: kinds of runs, how they ended, verdicts."""

from __future__ import annotations

from collections.abc import Mapping

from bufferstand.evaluation.wording.texts import said

_VERDICTS: Mapping[str, str] = {
    "pass": said("pass"),
    "conditional-pass": said("conditional pass"),
    "conditional-fail": said("conditional fail"),
    "fail": said("fail"),
    "inconclusive": said("inconclusive"),
    "not-tested": said("not tested"),
    "invalid": said("invalid"),
}
_KINDS: Mapping[str, str] = {
    "static": said("static"),
    "harmonic": said("harmonic"),
    "impact": said("impact"),
    "proof": said("proof"),
}
_TESTS: Mapping[str, str] = {
    "static": said("static test"),
    "harmonic": said("harmonic test"),
    "impact": said("impact test"),
    "proof": said("proof loads"),
}
"""Whole words: in some languages a kind is said in another form of a test than of a run."""
_STATUSES: Mapping[str, str] = {
    "complete": said("complete"),
    "stopped": said("stopped"),
    "failed": said("failed"),
    "recovered": said("recovered"),
    "imported": said("imported"),
}
_SPECIMENS: Mapping[str, str] = {
    "buffer": said("buffer"),
    "draw-gear": said("draw gear"),
    "elastomer": said("elastomer"),
    "rubber-steel": said("rubber-steel"),
    "ring-spring": said("ring-spring"),
}
_FINDINGS: Mapping[str, str] = {
    "clipped": said("clipped"),
    "drift": said("drift"),
    "frozen": said("frozen"),
    "gain-jump": said("gain jump"),
    "guard": said("guard"),
    "held": said("held"),
    "not-following": said("not following"),
    "offset-jump": said("offset jump"),
    "stroke-jump": said("stroke jump"),
    "sign": said("sign"),
    "spike": said("spike"),
    "unit": said("unit"),
    "unlike": said("unlike"),
    "zero": said("zero"),
    "scale": said("scale"),
    "delay": said("delay"),
    "slip": said("slip"),
    "exchanged": said("exchanged"),
    "detached": said("detached"),
    "swapped": said("swapped"),
}
_CHANNELS: Mapping[str, str] = {
    "force": said("force"),
    "stroke": said("stroke"),
    "temperature": said("temperature"),
}
_EFFECTS: Mapping[str, str] = {"spoils": said("spoils"), "noted": said("noted")}
_HOLDS: Mapping[str, str] = {"relaxation": said("relaxation"), "creep": said("creep")}


def verdict_words(verdict: object) -> str:
    """Return a verdict in words."""
    return _words(_VERDICTS, verdict)


def kind_words(kind: object) -> str:
    """Return a kind of run in words."""
    return _words(_KINDS, kind)


def test_words(kind: object) -> str:
    """Return a test of a kind in words."""
    return _words(_TESTS, kind)


def status_words(status: object) -> str:
    """Return how a run ended in words."""
    return _words(_STATUSES, status)


def specimen_words(name: object) -> str:
    """Return a kind of specimen or an elastic system in words; another text stays as it is."""
    return _SPECIMENS.get(str(name), str(name))


def effect_words(effect: object) -> str:
    """Return what a finding does to figures, in words."""
    return _words(_EFFECTS, effect)


def finding_words(kind: object) -> str:
    """Return what is the matter with a channel, in words."""
    return _words(_FINDINGS, kind)


def channel_words(name: object) -> str:
    """Return a channel in words; one with a name of its own keeps it."""
    return _CHANNELS.get(str(name)) or str(name).replace("_", " ")


def hold_words(kind: object) -> str:
    """Return a kind of hold in words."""
    return _words(_HOLDS, kind)


def _words(known: Mapping[str, str], name: object) -> str:
    """Return the words of a name; one that is not known is shown with spaces for its dashes."""
    return known.get(str(name)) or str(name).replace("-", " ")
