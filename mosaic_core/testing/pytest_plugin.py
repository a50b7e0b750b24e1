"""The kit's fixtures for pytest. Loaded with every pytest run of the environment, so nothing heavy is imported here."""
