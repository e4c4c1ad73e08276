"""Does evaluation say of a record what is wired wrong, and of a right one nothing?"""
