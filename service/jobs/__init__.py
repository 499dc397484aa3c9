"""Work on studies: submission, preview, the dispatcher, schedules, maintenance."""
