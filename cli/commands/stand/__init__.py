"""Commands on the stand: check, readings and motions by hand, and the simulated stand."""
