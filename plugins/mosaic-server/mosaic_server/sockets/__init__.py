"""The WebSockets: they carry out what the switchboard decides and decide nothing about the protocol themselves."""
