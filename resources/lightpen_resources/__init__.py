"""Data files of the desktop application."""
