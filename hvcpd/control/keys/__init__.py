"""The commands of the group “keys”."""
