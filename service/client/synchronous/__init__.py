"""Made from `sprag.service.client.asynchronous` by ``python -m tests.service.client.generate``: change it there."""
