"""Verification of tips and measurement of parts in the window."""
