"""The capture of a swing: states, rules, guidance and workflow."""
