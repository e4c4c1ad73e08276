"""Ground floor: what every room needs and no room owns (messages, units, files of settings, shared facts)."""
