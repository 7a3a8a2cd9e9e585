"""Proving a tip: the cone again, a ring, a length; the health of pen and camera."""
