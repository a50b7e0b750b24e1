"""Limits what somebody unknown may take of the server: connections, time and turns, counted by the address they come
from."""
