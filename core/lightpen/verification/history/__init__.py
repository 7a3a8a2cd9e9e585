"""Results over time: trend of a tip, health of a pen, improved LED files."""
