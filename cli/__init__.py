"""The commands: parsing of options and printing, nothing else."""
