"""What every HTTP answer has to obey, and the dashboard's files."""
