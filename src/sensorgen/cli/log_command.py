"""``sensorgen log``: what was measured of printed specimens, kept for good."""

from sensorgen.cli.log_read import log as command

__all__ = ["command"]
