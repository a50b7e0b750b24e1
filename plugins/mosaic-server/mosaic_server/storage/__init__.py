"""Stores what outlives the process: accounts, robots, ICE servers and keys, in one SQL database."""
