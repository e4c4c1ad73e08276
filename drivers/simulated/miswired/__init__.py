"""Wiring errors between specimen and computer: wires, scales, thermometers."""
