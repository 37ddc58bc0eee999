"""Hearing: front end, noise tracking, templates and the streaming grammar-constrained decoder."""
