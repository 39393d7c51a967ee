"""Plane-strain compression of a cell: outline, mesh, elements, contact, load steps, deformed capacitance."""
