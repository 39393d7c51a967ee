"""Measurements: log, instruments, recordings, signal processing."""
