"""Whether a device is ready, whether its outputs work, and what it says of itself, for people."""
