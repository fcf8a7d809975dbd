"""The command line: turns words into a job and a result into words."""
