"""What vehicles tell, as standard messages."""
