"""Files that people write and share: YAML with marks and units, designs, campaigns, runs, tracks, studies."""
