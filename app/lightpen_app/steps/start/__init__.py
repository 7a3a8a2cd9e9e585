"""The step Start: item under calibration, and interrupted swings."""
