"""Field data: wire, recording, rail position, files of others, and all of it end to end."""
