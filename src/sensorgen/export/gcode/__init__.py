"""G-code: what a line says, where the nozzle goes, whether the printer can do it, and in which words it wants it."""
