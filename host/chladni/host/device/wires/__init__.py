"""Ways to a device, and requests over any of them."""
