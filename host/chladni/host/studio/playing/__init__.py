"""What plays a press: the emulated device, a solver, a real device at a port; and its score."""
