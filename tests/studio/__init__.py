"""The studio, in a real browser and from a socket of our own."""
