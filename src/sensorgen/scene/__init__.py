"""Bodies and regions of a sensor: prisms, sections, unit cell, meshes, solids, drawing."""
