"""The step Start: who calibrates what, and swings that were interrupted."""
