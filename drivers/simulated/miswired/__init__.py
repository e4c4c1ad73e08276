"""What a person gets wrong between the specimen and the computer: wires, scales, thermometers."""
