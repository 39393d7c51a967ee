"""From the scene to bodies: triangle meshes, CAD solids, and whether they are valid."""
