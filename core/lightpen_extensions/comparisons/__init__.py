"""Calibrations compared: repeatability, recalculation, health of a pen, press test."""
