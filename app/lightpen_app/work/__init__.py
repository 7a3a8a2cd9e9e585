"""Qt objects around the core's runners; no rules."""
