"""From readings to presses: filter, pairs, drift, hysteresis, surfaces; verdicts and yield; the plan of a run."""
