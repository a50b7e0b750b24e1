"""Lines of logs: of files, and of the journal of systemd."""
