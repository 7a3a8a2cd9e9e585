"""Keys of stations and supervisors, and what a user account remembers."""
