"""Calibrations compared: trend and repeatability of a tip, health of a pen."""
