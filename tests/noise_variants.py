"""Variants of a campaign that differ in their noise: stated, not stated, stated wrongly, coloured and larger."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from tests.truth.files import UNITS, write_run

VARIANTS = ("as stated", "not stated", "stated x 3", "stated / 3", "coloured x 3")
COLOURED = ("ay1", "ay2", "ayf")
BAND = (0.3, 40.0)  # Hz


def noise_variant(source: Path, target: Path, variant: str) -> Path:
    """Copy a campaign whose noise line is true, and change its noise; return the copy."""
    target.mkdir(parents=True)
    campaign = load_campaign(source)
    for run in campaign.runs:
        shutil.copy(run.file, target / run.name)
    vehicle = re.search(r"^vehicle: *(\S+)", (source / "campaign.yaml").read_text(), re.MULTILINE)
    assert vehicle is not None
    shutil.copy(source / vehicle[1], target / "vehicle.yaml")
    text = (source / "campaign.yaml").read_text().replace(vehicle[0], "vehicle: vehicle.yaml")
    factor = {"stated x 3": 3.0, "stated / 3": 1.0 / 3.0}.get(variant)
    stated = ", ".join(f"{c}: {sd * (factor or 1.0):.9g}" for c, sd in campaign.noise.items())
    line = "" if variant == "not stated" else f"noise: {{{stated}}}\n"
    text, found = re.subn(r"^noise:.*\n?", line, text, flags=re.MULTILINE)
    assert found == 1
    (target / "campaign.yaml").write_text(text)
    if variant == "coloured x 3":
        _add_coloured_noise(target)
    return target


def _add_coloured_noise(folder: Path) -> None:
    """Add 1/f noise to the accelerations, in the band three times the stated noise."""
    dataset = read_dataset(load_campaign(folder))
    for k, (entry, run) in enumerate(zip(dataset.campaign.runs, dataset.runs, strict=True)):
        rng = np.random.default_rng([5, k])
        columns = dict(run.columns)
        n, rate = len(columns["t"]), run.rate
        for c in COLOURED:
            white = dataset.campaign.noise[c] * np.sqrt((BAND[1] - BAND[0]) / (0.5 * rate))  # in the band
            columns[c] = columns[c] + 3.0 * white * pink(rng, n, rate)
        write_run(entry.file, {c: columns[c] for c in UNITS if c in columns}, UNITS)


def pink(rng: np.random.Generator, n: int, rate: float) -> np.ndarray:
    """Noise [n] with a density of 1/f, of unit variance in the band and flat below half its lower end."""
    f = np.fft.rfftfreq(n, 1.0 / rate)
    density = 1.0 / np.maximum(f, 0.5 * BAND[0])
    lines = np.sqrt(density) * (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f)))
    lines[0] = 0.0
    in_band = np.fft.irfft(np.where((f >= BAND[0]) & (f <= BAND[1]), lines, 0.0), n)
    return np.asarray(np.fft.irfft(lines, n) / in_band.std())
