"""Prediction of a sensor's readings, with its error budget, identifiability and inverse."""
