"""The command that finds a board for a SPEC."""
