"""Numerical solvers: arrays in, arrays out. They know no sensor."""
