"""What a sensor should measure, with its error budget, identifiability and inverse."""
