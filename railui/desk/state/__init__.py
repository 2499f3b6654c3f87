"""State of a session: designs in work, search plans."""
