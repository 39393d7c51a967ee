"""Speed against accuracy for one design: every model that applies to it, and other programs, timed in new processes."""
