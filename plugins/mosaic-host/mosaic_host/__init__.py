"""What a robot's own computer offers: JSON from HTTP servers, logs, and programs that operators may run."""
