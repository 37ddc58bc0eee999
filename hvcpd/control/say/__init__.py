"""The commands of the group “say”."""
