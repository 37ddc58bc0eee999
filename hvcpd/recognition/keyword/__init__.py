"""Hears one word, whoever says it and over whatever else is heard."""
