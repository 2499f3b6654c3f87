"""The report of a ride: time histories, spectra, guiding forces."""
