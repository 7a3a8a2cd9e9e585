"""Checks of an archive and of the files that it refers to."""
