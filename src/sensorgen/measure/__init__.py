"""What was measured: log, instruments, recordings, signal processing."""
