"""Commands about effects, and the one that plays them."""
