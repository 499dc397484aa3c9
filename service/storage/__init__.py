"""The database: the only channel between the service and the dispatcher."""
