"""Views: what can be answer of a case or of a study, each described once for the API, the pages and the commands."""
