"""Copies of chains on a server and in other archives."""
