"""What a person sees of a mission: the live terminal, the report page, the transcript."""
