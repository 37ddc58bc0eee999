"""The command `hvcpctl duet`."""
