"""The coil actuator of the paper's section II, and the waves that drive it."""
