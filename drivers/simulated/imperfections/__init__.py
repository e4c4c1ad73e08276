"""The imperfections of real stands, for the simulated one."""
