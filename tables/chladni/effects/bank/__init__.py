"""The effect bank: effects and areas as a device keeps them in flash."""
