"""Signal processing: filters, spectra, discretisation, integration."""
