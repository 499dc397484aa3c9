"""Views: what can be asked of a case or of a study, each described once for the API, the pages and the commands."""
