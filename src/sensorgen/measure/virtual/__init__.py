"""A virtual laboratory: a printed specimen, the rig that presses it, and devices with the real ones' protocols."""
