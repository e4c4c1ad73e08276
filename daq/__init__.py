"""Doing it: acquisition, guards, the safe stop, the campaign runner and its progress."""
