"""Identifiability: how precisely impedance determines force and position (Cramer-Rao), and what would improve it."""
