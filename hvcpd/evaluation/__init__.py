"""Repeats the paper's experiments: `hvcpctl evaluate`."""
