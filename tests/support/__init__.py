"""Holds what tests of several folders share: waiting, processes of ours, a server with accounts, robots."""
