"""Terminal user interface: panels for design, campaign, optimisation, track and capture."""
