"""The wording for what a stand cannot guard."""

NO_TEMPERATURE_STOP = "this campaign has no temperature stop"
"""Of a stand without a thermometer on the specimen; the reason follows."""
