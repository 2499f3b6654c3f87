"""Track: spectra, synthetic and measured lines, and the input tables that drive a vehicle."""

from railui.track.input_table import (
    COLUMNS,
    COLUMNS_PER_WHEELSET,
    FIRST_WHEELSET_COLUMN,
    Spacing,
    Wheelbase,
    add_track,
    distance_from_speed,
    input_table,
    run_table,
    track_table,
    wheelset_distances,
)
from railui.track.line import Track, equally_spaced
from railui.track.line_geometry import LinePositions
from railui.track.metrics import BANDS, NearestSpectrum, TrackSpectrum, band_sd, nearest_spectrum, psd
from railui.track.spectra import QUANTITIES, SPECTRA, Quantity, Spectrum, spectrum_density, spectrum_named, spectrum_sd
from railui.track.synthetic import TrackSpec, band_limited_noise, parse_spec, synthetic_track

__all__ = [
    "BANDS",
    "COLUMNS",
    "COLUMNS_PER_WHEELSET",
    "FIRST_WHEELSET_COLUMN",
    "QUANTITIES",
    "SPECTRA",
    "LinePositions",
    "NearestSpectrum",
    "Quantity",
    "Spacing",
    "Spectrum",
    "Track",
    "TrackSpec",
    "TrackSpectrum",
    "Wheelbase",
    "add_track",
    "band_limited_noise",
    "band_sd",
    "distance_from_speed",
    "equally_spaced",
    "input_table",
    "nearest_spectrum",
    "parse_spec",
    "psd",
    "run_table",
    "spectrum_density",
    "spectrum_named",
    "spectrum_sd",
    "synthetic_track",
    "track_table",
    "wheelset_distances",
]
