"""The logbook of a station: it enters events, and updates the status of tips."""
