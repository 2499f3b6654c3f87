"""The kernel's own tests on a processor with AVX-512, emulated: Bochs' Skylake-X under a Linux that holds nothing else.

python release/emulated.py [--linux /boot/vmlinuz-...] [--model corei7_skylake_x]

For those who change the kernel and have no such processor. Debian: apt-get install bochs bochs-term busybox-static
grub-pc-bin grub-common xorriso mtools cpio, and the image of any linux-image package. Ten minutes on one core.
"""

from __future__ import annotations

import argparse
import gzip
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
NEEDED = ("bochs", "busybox", "grub-mkrescue", "xorriso", "mformat", "cpio", "cargo")
FIRMWARE = Path("/usr/share/bochs")
PATIENCE = 3600.0  # s

INIT = """\
#!/bin/sh
mount -t proc proc /proc
mount -t devtmpfs dev /dev
exec >/dev/ttyS0 2>&1
for test in /tests/*; do RUST_TEST_THREADS=1 $test --nocapture; echo "$test ended with $?"; done
echo THE END
sleep 10  # until the wire has told it all
poweroff -f
"""
# without compact saving: Bochs tells its size wrongly, and Linux would do without vectors
OPTIONS = "console=ttyS0 quiet mitigations=off clearcpuid=xsavec,xsaves"
GRUB = f"""\
set timeout=0
menuentry tests {{ linux /boot/vmlinuz {OPTIONS} ; initrd /boot/initrd.gz }}
"""
MACHINE = """\
cpu: model={model}, count=1, ips=50000000, ignore_bad_msrs=1
megs: 512
romimage: file={firmware}/BIOS-bochs-latest
vgaromimage: file={firmware}/VGABIOS-lgpl-latest
ata0: enabled=1, ioaddr1=0x1f0, ioaddr2=0x3f0, irq=14
ata0-master: type=cdrom, path="disc.iso", status=inserted
boot: cdrom
com1: enabled=1, mode=file, dev=serial.txt
display_library: term
log: bochs.log
panic: action=fatal
clock: sync=none
"""


def tests() -> list[Path]:
    """The kernel's tests, compiled."""
    told = subprocess.run(
        ["cargo", "test", "--release", "--package", "railui_core", "--no-run", "--message-format", "json"],
        cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True,
    ).stdout  # fmt: skip
    made = [Path(m["executable"]) for m in map(json.loads, told.splitlines()) if m.get("executable")]
    return [test for test in made if not test.name.startswith("floors-")]  # they read the sources


def disc(home: Path, linux: Path) -> None:
    """A disc that starts, runs the tests and stops."""
    root, boot = home / "root", home / "iso" / "boot"
    for folder in (root / "tests", root / "bin", root / "proc", root / "dev", boot / "grub"):
        folder.mkdir(parents=True)
    shutil.copy(shutil.which("busybox") or "", root / "bin" / "busybox")
    for tool in ("sh", "mount", "echo", "sleep", "poweroff"):
        (root / "bin" / tool).symlink_to("busybox")
    for test in tests():
        shutil.copy(test, root / "tests" / re.sub("-[0-9a-f]+$", "", test.name))
        for library in re.findall(r"(/\S+)", subprocess.run(["ldd", test], capture_output=True, text=True).stdout):
            to = root / library.lstrip("/")
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(library, to)
    (root / "init").write_text(INIT)
    (root / "init").chmod(0o755)
    names = "\n".join(str(p.relative_to(root)) for p in root.rglob("*"))
    packed = subprocess.run(
        ["cpio", "--create", "--format=newc", "--owner=0:0", "--quiet"], cwd=root, input=names.encode(),
        stdout=subprocess.PIPE, check=True,
    ).stdout  # fmt: skip
    (boot / "initrd.gz").write_bytes(gzip.compress(packed, 1))
    shutil.copy(linux, boot / "vmlinuz")
    (boot / "grub" / "grub.cfg").write_text(GRUB)
    subprocess.run(["grub-mkrescue", "-o", home / "disc.iso", home / "iso"], capture_output=True, check=True)


def emulated(home: Path, model: str) -> str:
    """What the machine printed until it stopped."""
    (home / "bochsrc").write_text(MACHINE.format(model=model, firmware=FIRMWARE))
    (home / "go").write_text("continue\n")  # Debian's emulator waits in its debugger
    serial = home / "serial.txt"
    # its screen wants a terminal
    machine = subprocess.Popen(
        ["script", "--quiet", "--command", "bochs -q -f bochsrc -rc go", "/dev/null"], cwd=home,
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    began, shown = time.monotonic(), 0
    try:
        while time.monotonic() - began < PATIENCE and machine.poll() is None:
            time.sleep(1.0)
            text = serial.read_text(errors="replace") if serial.exists() else ""
            print(text[shown:], end="", flush=True)
            shown = len(text)
            if "THE END" in text:
                return text
    finally:
        subprocess.run(["pkill", "--session", str(machine.pid)], check=False)
    raise SystemExit(f"the machine stopped before the tests did: {home}/bochs.log")


def main() -> None:
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--linux", type=Path, help="the newest in /boot where not given")
    ask.add_argument("--model", default="corei7_skylake_x", help="see bochs --help cpu")
    asked = ask.parse_args()
    linux = asked.linux or max(Path("/boot").glob("vmlinuz-*"), default=None)
    missing = [tool for tool in NEEDED if shutil.which(tool) is None]
    if missing or linux is None:
        raise SystemExit(f"missing: {', '.join(missing) or 'a Linux image, give --linux'}\n{__doc__}")
    home = Path(tempfile.mkdtemp(prefix="emulated-"))
    disc(home, linux)
    told = emulated(home, asked.model)
    ended = re.findall(r"^(/tests/\S+) ended with (\d+)", told, re.MULTILINE)
    if "v4 as portable" not in told or any(code != "0" for _, code in ended):  # the levels tell theirs
        raise SystemExit(f"not all went well: {home}")
    shutil.rmtree(home)
    print(f"\n{len(ended)} sets of tests passed on {asked.model}, at the level v4")


if __name__ == "__main__":
    sys.exit(main())
