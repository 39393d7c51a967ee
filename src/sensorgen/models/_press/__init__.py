"""Plane-strain compression of a cell: outline, mesh, elements, contact, load steps, and the capacitance when deformed."""
