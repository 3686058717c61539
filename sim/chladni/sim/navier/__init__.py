"""Simply supported plates, in closed form."""
