"""The live monitor: the acquiring process tells, a process of its own shows it to browsers."""
