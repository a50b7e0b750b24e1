"""The server that a robot runs for its own network: `mosaic run --serve`, `mosaic lan …`."""
