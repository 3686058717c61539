"""How a board is wired: its drawing, its parts list, and the values that both have."""
