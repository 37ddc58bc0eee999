"""The commands of the group “hear”."""
