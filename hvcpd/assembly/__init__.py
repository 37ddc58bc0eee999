"""One robot put together from its plan."""
