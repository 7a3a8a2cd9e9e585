"""The logbook of a station: what it enters, and what follows for its tips."""
