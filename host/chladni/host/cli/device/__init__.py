"""Commands that connect to a device: query it, play on it, configure it, write to its flash."""
