"""`hvcpctl bench`."""
