"""Material values out of what was measured, as a new source."""
