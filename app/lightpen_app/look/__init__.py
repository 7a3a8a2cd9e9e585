"""Texts, numbers, colours and sounds."""
