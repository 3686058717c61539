"""A device that does not run: its ROM loader, and images of its flash."""
