"""JSON that an HTTP server answers with."""
