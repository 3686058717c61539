"""Magnets and round windings as such: fluxes, forces, inductance; knows no board."""
