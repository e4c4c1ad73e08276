"""Commands on calibrations: taking one from a certificate."""
