"""A thin sheet on foam under a pressing finger: large deflection, and the vibration about it."""
