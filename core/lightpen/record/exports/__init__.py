"""Tips for other programs: tables, DCC, trackers, robots, statistics."""
