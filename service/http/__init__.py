"""The service over HTTP: server, authentication, problems, and the parts shared by the API and the pages."""
