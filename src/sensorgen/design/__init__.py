"""Request for a sensor: shape, parameters, materials with sources, printer, quality."""
