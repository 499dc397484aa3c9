"""Pages for a browser, made on the server; they load nothing from another host."""
