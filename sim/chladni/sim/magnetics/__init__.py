"""Magnets and round windings as such: fluxes, forces, inductance. Imports no board."""
