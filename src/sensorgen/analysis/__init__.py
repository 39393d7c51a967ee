"""Measured beside predicted: comparison, fit, report, plots."""
