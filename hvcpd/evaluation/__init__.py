"""The paper's experiments, again: `hvcpctl evaluate`."""
