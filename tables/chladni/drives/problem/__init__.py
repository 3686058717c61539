"""A board solved with one target on it: its fields, its places, what a drive is best at."""
