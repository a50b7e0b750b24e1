"""Questions to a vehicle: commands, parameters and missions, each a pure machine with a thin driver."""
