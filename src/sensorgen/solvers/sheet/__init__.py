"""Conducting sheets coupled by a distributed admittance."""
