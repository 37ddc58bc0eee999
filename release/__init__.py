"""What is made of the sources for others: a Debian package and a software bill of materials."""
