"""A board solved with one target on it: its fields, its regions, where second fingers lie."""
