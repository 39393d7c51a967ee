"""Transmission lines with position-dependent sections: inputs, slopes, series."""
