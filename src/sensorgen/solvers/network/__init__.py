"""Resistor networks of extruded tracks."""
