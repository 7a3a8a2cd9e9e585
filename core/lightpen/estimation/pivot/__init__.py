"""Pivot calibration from poses: closed form, two stages, pose conventions."""
