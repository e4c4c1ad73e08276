"""Requirements of standards: limits as data, conditions of the test, verdicts with a decision rule."""
