"""The stroke at its turning points: how sharp they are, and the force there, for each branch."""
