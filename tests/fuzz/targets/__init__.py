"""The targets, by what is read."""
