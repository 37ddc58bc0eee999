"""The commands of the group “live”."""
