"""Errors, units, bounds, files, cache, YAML and parallel work: what every package needs."""
