"""The emulated device, and the loop from its pins back to the plate."""
