"""Design as printed: a scene that every model reads, in place of the drawing.

From a slicer's G-code where there is one, else estimated from each layer's mid-plane by the slicer's own rules.
"""
