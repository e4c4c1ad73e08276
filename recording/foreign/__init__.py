"""Foreign records: files of other makers, read into run files without guessing."""
