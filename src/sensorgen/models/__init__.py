"""Physical models, one per file, from cheap to dear; each says which scenes it cannot speak of.

A capacitance model has ``SOURCE``, ``COST`` (0 closed form, 1 quadrature, 2 field solve),
``why_not_applicable(scene)`` and ``capacitance(scene, permittivity)``; a line model has ``impedance``.
Models speak SI; the scene is in millimetres, and each model converts it where it reads it.
"""
