"""Small changes made on purpose to what must not break: each must fail a test."""
