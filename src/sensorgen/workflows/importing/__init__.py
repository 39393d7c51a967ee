"""Sensors from other CAD programs: read, repaired or refused, mapped to materials, written as a design."""
