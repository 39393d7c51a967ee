"""Calibration of one specimen by known presses, and inversion of its readings with the doubt that remains.

Readings count as ratios to a fresh reading at rest: gains cancel, and slow changes of the specimen nearly so.
"""
