"""A board's transfer fields: which plate it is, and what its actuators do to it."""
