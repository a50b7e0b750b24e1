"""The link to vehicles: bytes, messages, heartbeats, and what is known of each vehicle."""
