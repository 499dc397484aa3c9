"""Reports of schedules: what they say, how they are sent, and the watchdog for what did not run."""
