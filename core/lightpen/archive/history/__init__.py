"""Queries of an archive: entries by filters, the history of tips, what is due."""
