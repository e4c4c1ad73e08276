"""A LabJack T7 or T8 on Modbus TCP, written from LabJack's documents alone; no look at any driver."""
