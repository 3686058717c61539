"""Where coils may stand, and which of these layouts a search begins with."""
