"""What README and docs print is what the commands print."""
