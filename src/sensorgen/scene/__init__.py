"""Which material fills which region: prisms, sections, unit cell, meshes, solids, drawing."""
