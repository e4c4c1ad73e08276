"""bufferstand: test-stand data acquisition and evaluation for railway buffers and draw gear."""
