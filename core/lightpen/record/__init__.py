"""A swing on disk, its solution and the results that were accepted."""
