"""Which runs of a specimen are its conformity test, and which only state characteristics."""
