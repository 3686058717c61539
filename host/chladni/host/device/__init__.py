"""Connecting to a device and querying it: wires, link, UDP, uploads."""
