"""Calibrations as records and text, their verdicts and warnings."""
