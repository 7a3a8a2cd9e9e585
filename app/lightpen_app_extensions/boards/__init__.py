"""Camera calibration with boards in the window."""
