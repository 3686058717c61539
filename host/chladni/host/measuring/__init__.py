"""A device that measures its own board."""
