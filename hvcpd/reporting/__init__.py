"""The views of a mission: the live terminal, the report page, the transcript."""
