"""Complete sets of files: build, slice, batch."""
