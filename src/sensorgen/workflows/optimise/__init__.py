"""The best printable designs for a target: every design of a space, discarded with a reason or evaluated as printed."""
