"""Arrays of crossing tracks: one cell law for all crossings, the network of the tracks, readouts, frames."""
