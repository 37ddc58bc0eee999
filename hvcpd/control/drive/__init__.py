"""The commands of the group “drive”."""
