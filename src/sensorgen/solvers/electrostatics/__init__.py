"""Certified bounds of a capacitance from hp finite elements in 2D and 3D."""
