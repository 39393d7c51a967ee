"""The laboratory: devices, experiments, and the run that presses a specimen and records it."""
