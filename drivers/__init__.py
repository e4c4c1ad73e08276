"""Talk to one device each: wires, registers, readings. Knows nothing of tests."""
