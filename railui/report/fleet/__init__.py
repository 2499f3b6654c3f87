"""Page of a fleet, and the full loops behind its alarms."""
