"""Sensor shapes: one file each, with its parameters (``Params``) and its ``scene``.

A shape is known by its file name. It imports :mod:`sensorgen.scene.scene` and the standard library only.
"""
