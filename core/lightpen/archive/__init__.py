"""The archive: one entry for each calibration accepted, rejected or abandoned."""
