"""The database of an archive: its tables, opened for reading and writing."""
