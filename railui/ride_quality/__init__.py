"""Ride quality: comfort, guidance, running safety, track assessment."""
