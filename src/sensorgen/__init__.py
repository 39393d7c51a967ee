"""sensorgen: from one design to a printable elastomer sensor, its prediction and its report."""

__version__ = "0.1.0"
