"""Coupled lines of stacked electrodes."""
