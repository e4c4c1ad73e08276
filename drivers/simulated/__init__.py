"""The simulated stand: the devices of a real one, made of physics, in process or on the real wires."""
