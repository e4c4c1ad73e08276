"""Emulators of Modbus I/O that can be bought, made from the pages in docs/facts/devices.md alone.

They were written and committed before the driver ``drivers/acquisition/modbus_io`` was begun, by the same
hand: whoever writes a further one should not have seen it. Nothing here imports ``bufferstand`` or pymodbus.
"""
