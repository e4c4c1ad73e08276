"""First contact of a static run: where the force leaves its rest level, beside the recorded stroke zero."""
