"""State of a session: drafts of designs, search plans, form rows."""
