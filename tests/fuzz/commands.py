"""Small files of every kind, and the command lines that read them."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from railui.capture.formats import read_recordings, write_recording
from railui.capture.processing.recording import Recording
from railui.capture.protocol import wire
from railui.capture.protocol.messages import Channel
from railui.io.table import read_table, write_table
from railui.track import synthetic_track
from railui.track.reader import save_track

DESIGNS = Path(__file__).parents[2] / "designs"
ROWS = 2600  # of the runs: 13 s
TRACK = "erri_b176_low length=300 seed=1"
SHARE_OF_FITS = 0.003  # of the cases, since a fit takes seconds
RIDE = ("--track", TRACK, "--speed", "30")
GRID = ("--x", "contact.conicity=0.1:0.2:0.1", "--y", "vehicle.primary.lateral_stiffness=2e6:3e6:1e6")
CURVE = "v [mm/s],F [kN]\n-300,-4\n-100,-2.5\n0,0\n100,1.5\n300,2\n"
MOUNTED = """effects:
  - {element: curve.csv, at: secondary_lateral, count: 2}
  - {element: {damper: {velocity: [0, 0.1, 0.3], force: [0, 1 kN, 2 kN], symmetric: true}}, at: primary_lateral}
"""
# file that is mutated, and the words of a command that reads it
TEMPLATES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("test_bogie.yaml", ("check", "test_bogie.yaml")),
    ("profiled_bogie.yaml", ("check", "profiled_bogie.yaml")),
    ("bogie_under_coach.yaml", ("check", "bogie_under_coach.yaml")),
    ("test_bogie.yaml", ("ride", "test_bogie.yaml", *RIDE)),
    ("cooperrider.yaml", ("ride", "cooperrider.yaml", *RIDE)),
    ("track.csv", ("ride", "test_bogie.yaml", "--track", "track.csv", "--speed", "30")),
    ("check_bogie.yaml", ("stability", "check_bogie.yaml", "--speeds", "10:50:20")),
    ("test_bogie.yaml", ("curve", "test_bogie.yaml", "--radii", "300:900:300", "--cant-deficiency", "100 mm")),
    ("track.csv", ("assess", "track.csv", "test_bogie.yaml", "--speed", "30", "--stretch", "100")),
    ("track.csv", ("track", "track.csv")),
    ("test_bogie.yaml", ("track", TRACK)),
    ("profiles/s1002.txt", ("check", "profiles/s1002.txt")),
    ("profiles/60e1.txt", ("check", "profiles/60e1.txt")),
    ("delta_r.csv", ("contact", "--delta-r", "delta_r.csv", "--sd", "2 mm")),
    ("campaign/run_a.csv", ("check", "campaign/run_a.csv")),
    ("campaign/run_a.csv", ("check", "campaign/campaign.yaml")),
    ("campaign/campaign.yaml", ("check", "campaign/campaign.yaml")),
    ("campaign/run_a.csv", ("import", "campaign/run_a.csv")),
    ("campaign/run_a.csv", ("import", "campaign/run_a.csv", "--map", "map.yaml", "-o", "out.csv")),
    ("map.yaml", ("import", "campaign/run_a.csv", "--map", "map.yaml", "-o", "out.csv")),
    ("map.yaml", ("check", "map.yaml")),
    ("bench.h5", ("import", "bench.h5")),
    ("bench.mf4", ("import", "bench.mf4")),
    ("bench.uff", ("import", "bench.uff")),
    ("bench.mat", ("import", "bench.mat")),
    ("raw.bin", ("capture", "decode", "raw.bin", "-o", "decoded")),
    ("study.yaml", ("check", "study.yaml")),
    ("study.yaml", ("optimise", "study.yaml", "--dry-run")),
    ("test_bogie.yaml", ("diff", "test_bogie.yaml", "cooperrider.yaml")),
    ("test_bogie.yaml", ("schema", "design")),
    ("test_bogie.yaml", ("effects",)),
    ("study.yaml", ("status", "campaign")),
    ("check_bogie.yaml", ("response", "check_bogie.yaml", "--track", TRACK, "--speed", "30", "--frequencies", "1:9:1")),
    ("track.csv", ("response", "cooperrider.yaml", "--track", "track.csv", "--speed", "30", "--channels", "e1,ayf")),
    ("check_bogie.yaml", ("map", "check_bogie.yaml", *GRID, "--of", "linear_damping", "--speed", "30", "-o", "grid")),
    ("check_bogie.yaml", ("sensitivity", "check_bogie.yaml", "--of", "linear_damping", "--speed", "30")),
    ("curve.csv", ("ride", "digressive.yaml", *RIDE, "--series", "out.csv")),
    ("digressive.yaml", ("check", "digressive.yaml")),
)
FITS = (
    ("profiles/60e1.txt", ("contact", "profiles/s1002.txt", "profiles/60e1.txt", "--inclination", "1:40")),
    ("campaign/run_a.csv", ("adjust", "campaign")),
    ("campaign/campaign.yaml", ("adjust", "campaign")),
)
MAP = "speed: {channel: v}\nsensors: {yw: {channel: yw}, e1: {channel: e1}, ay1: {channel: ay1, gravity: removed}}\n"


def write_files(home: Path) -> None:
    """Write the files of the templates."""
    shutil.copytree(DESIGNS, home, ignore=shutil.ignore_patterns("campaigns"), dirs_exist_ok=True)
    (home / "campaign").mkdir()
    for name in ("run_a", "run_b"):
        table = read_table(DESIGNS / f"campaigns/worn_axle_box/{name}.csv.gz")
        units = dict(zip(table.names, table.units, strict=True))
        columns = {f"{n} [{units[n]}]": table.column(n)[:ROWS] for n in table.names if n not in ("d1", "d2", "ayf")}
        write_table(home / "campaign" / f"{name}.csv", columns, digits=7)
    runs = "[{file: run_a.csv, role: adjust}, {file: run_b.csv, role: validate}]"
    (home / "campaign/campaign.yaml").write_text(f"name: fuzz\nvehicle: ../test_bogie.yaml\nruns: {runs}\n")
    (home / "map.yaml").write_text(MAP)
    (home / "curve.csv").write_text(CURVE)
    (home / "digressive.yaml").write_text((home / "test_bogie.yaml").read_text() + MOUNTED)
    shutil.copy(home / "studies/test_bogie.yaml", home / "study.yaml")
    (home / "study.yaml").write_text((home / "study.yaml").read_text().replace("../", ""))
    track = synthetic_track("erri_b176_low", length=300.0, seed=1)
    save_track(home / "track.csv", track.s, track.yw, track.phiw, track.gauge)
    y = np.linspace(-8, 8, 33)
    write_table(home / "delta_r.csv", {"y [mm]": y, "delta_r [mm]": 0.3 * y + 0.002 * y**3})
    t = np.arange(400) / 200.0
    recording = Recording("bench", t, {"acc": np.sin(20 * t), "way": np.cos(3 * t)}, {"acc": "m/s^2", "way": "mm"})
    for suffix in (".h5", ".mf4", ".uff", ".mat"):
        write_recording(home / f"bench{suffix}", recording)
        read_recordings(home / f"bench{suffix}")
    (home / "raw.bin").write_bytes(raw_stream())


def raw_stream() -> bytes:
    """Return the bytes of a logger with two channels."""
    channels = [Channel(name, "m/s^2", "h", 0.001, 0.0) for name in ("a", "b")]
    body = wire.hello_body(1, 200.0, "logger", "1", channels)
    layout = wire.layout_hash(body)
    samples = (wire.encode_sample(layout, k, 5000 * k, bytes([k % 251, 1, 2, 0])) for k in range(1, 400))
    return wire.encode_hello(0, body) + b"".join(samples)
