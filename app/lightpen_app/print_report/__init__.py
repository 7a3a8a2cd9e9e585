"""The calibration report: text, pages, print and PDF."""
