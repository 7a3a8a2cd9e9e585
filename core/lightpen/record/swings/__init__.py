"""A swing on disk: header, journal, images, and its solution."""
