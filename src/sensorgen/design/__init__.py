"""What was asked for: shape, parameters, materials with sources, printer, quality."""
