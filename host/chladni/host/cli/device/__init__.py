"""Commands that reach a device: ask it, play on it, configure it, and write to its flash."""
