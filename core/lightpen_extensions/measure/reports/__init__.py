"""Verifications as JSON records, text tables and control charts."""
