"""What benches start: MOSAIC's own processes, a browser, and the process at the other end of a comparison."""
