"""Commands that work on recorded runs: find, verify, import, evaluate, compare, report."""
