"""The service over HTTP: the server, who may ask, problems, and the kit of the two kinds of answers."""
