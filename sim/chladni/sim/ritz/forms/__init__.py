"""Matrices of one parity class: energies of the plate and of what is on it, and its supports."""
