"""Inverse problem: force and position from impedance, with covariance, or a status."""
