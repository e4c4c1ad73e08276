"""Long runs: does anything grow that ought not to? ``python -m tests.soak virtual | real``."""
