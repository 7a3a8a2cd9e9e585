"""Uncertainty of a tip: budget, prediction, and the instrument it leaves."""
