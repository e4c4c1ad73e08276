"""One module for each sub-command, in groups by purpose; each holds `command`."""
