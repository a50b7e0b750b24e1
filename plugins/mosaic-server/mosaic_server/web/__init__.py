"""Serves the dashboard's files, and guards what every HTTP answer has to obey."""
