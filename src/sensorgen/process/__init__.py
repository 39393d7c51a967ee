"""From readings of a run to presses: filter, pairs, drift, hysteresis, surfaces; verdicts and yield; the plan of a run."""
