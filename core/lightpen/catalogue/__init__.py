"""The message catalogue: code and English template, a module for each area."""
