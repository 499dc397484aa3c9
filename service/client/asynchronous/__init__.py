"""The client, written once. `sprag_study.service.client.synchronous` is made from this package by
``python -m tests.service.client.generate``, which leaves out ``async`` and ``await``; a test compares them.
"""
