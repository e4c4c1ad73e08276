"""What happened: journal, sealing, the HDF5 run file, verifying, finding; and foreign records coming in."""
