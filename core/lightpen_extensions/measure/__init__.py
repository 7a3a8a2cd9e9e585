"""Verification of tips, and parts measured with them."""
