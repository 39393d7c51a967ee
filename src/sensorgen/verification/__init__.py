"""Checks against the thesis, and speed against accuracy of every model; nothing imports it."""
