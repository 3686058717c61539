"""How good a drive is, and how ways to find drives compare."""
