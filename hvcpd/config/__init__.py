"""Settings and task repositories: strict YAML in, frozen dataclasses out, all faults of a file in one error."""
