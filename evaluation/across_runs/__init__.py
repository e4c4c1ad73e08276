"""Several runs together: the errors that they share, and figures made of several runs."""
