"""The same examples on every run, on every machine; a failure here is a failure everywhere."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("hvcpd", derandomize=True, database=None, deadline=None, print_blob=True)
settings.load_profile("hvcpd")
