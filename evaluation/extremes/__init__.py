"""Extremes of a run: the least and the greatest of all its samples, apart from any mean."""
