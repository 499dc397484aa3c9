"""Made from `sprag_study.service.client.asynchronous` by ``python -m tests.service.client.generate``."""
