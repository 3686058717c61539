"""Reaching a device and asking it: wires, link, UDP, uploads."""
