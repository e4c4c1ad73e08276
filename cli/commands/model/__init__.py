"""Commands on the spring model: fit, simulate, compare, export."""
