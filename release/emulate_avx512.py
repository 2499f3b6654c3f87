"""Run the kernel's tests on an emulated processor with AVX-512: Bochs' Skylake-X under a minimal Linux.

python release/emulate_avx512.py [--linux /boot/vmlinuz-...] [--model corei7_skylake_x]

For changes of the kernel on machines without such a processor. Debian: apt-get install bochs bochs-term busybox-static
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
REQUIRED_TOOLS = ("bochs", "busybox", "grub-mkrescue", "xorriso", "mformat", "cpio", "cargo")
FIRMWARE = Path("/usr/share/bochs")
TIMEOUT = 3600.0  # s

INIT = """\
#!/bin/sh
mount -t proc proc /proc
mount -t devtmpfs dev /dev
exec >/dev/ttyS0 2>&1
for test in /tests/*; do RUST_TEST_THREADS=1 $test --nocapture; echo "$test ended with $?"; done
echo THE END
sleep 10  # until the serial line is empty
poweroff -f
"""
# without XSAVEC: Bochs reports its size wrongly, and Linux would disable vector registers
KERNEL_OPTIONS = "console=ttyS0 quiet mitigations=off clearcpuid=xsavec,xsaves"
GRUB = f"""\
set timeout=0
menuentry tests {{ linux /boot/vmlinuz {KERNEL_OPTIONS} ; initrd /boot/initrd.gz }}
"""
BOCHS_CONFIGURATION = """\
cpu: model={model}, count=1, ips=50000000, ignore_bad_msrs=1
megs: 512
romimage: file={firmware}/BIOS-bochs-latest
vgaromimage: file={firmware}/VGABIOS-lgpl-latest
ata0: enabled=1, ioaddr1=0x1f0, ioaddr2=0x3f0, irq=14
ata0-master: type=cdrom, path="disc.iso", status=inserted
boot: cdrom
com1: enabled=1, mode=file, dev=serial.txt
display_library: term
sound: driver=dummy
log: bochs.log
panic: action=fatal
clock: sync=none
"""


def compile_tests() -> list[Path]:
    """Compile the kernel's tests and return their executables."""
    output = subprocess.run(
        ["cargo", "test", "--locked", "--release", "--package", "railui_core", "--no-run", "--message-format", "json"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    ).stdout
    executables = [Path(m["executable"]) for m in map(json.loads, output.splitlines()) if m.get("executable")]
    return [test for test in executables if not test.name.startswith("layers-")]  # reads the sources


def create_disc(home: Path, linux: Path) -> None:
    """Create a bootable disc that runs the tests and powers off."""
    root, boot = home / "root", home / "iso" / "boot"
    for folder in (root / "tests", root / "bin", root / "proc", root / "dev", boot / "grub"):
        folder.mkdir(parents=True)
    shutil.copy(shutil.which("busybox") or "", root / "bin" / "busybox")
    for tool in ("sh", "mount", "echo", "sleep", "poweroff"):
        (root / "bin" / tool).symlink_to("busybox")
    for test in compile_tests():
        shutil.copy(test, root / "tests" / re.sub("-[0-9a-f]+$", "", test.name))
        for library in re.findall(r"(/\S+)", subprocess.run(["ldd", test], capture_output=True, text=True).stdout):
            target = root / library.lstrip("/")
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(library, target)
    (root / "init").write_text(INIT)
    (root / "init").chmod(0o755)
    names = "\n".join(str(p.relative_to(root)) for p in root.rglob("*"))
    archive = subprocess.run(
        ["cpio", "--create", "--format=newc", "--owner=0:0", "--quiet"],
        cwd=root,
        input=names.encode(),
        stdout=subprocess.PIPE,
        check=True,
    ).stdout
    (boot / "initrd.gz").write_bytes(gzip.compress(archive, 1))
    shutil.copy(linux, boot / "vmlinuz")
    (boot / "grub" / "grub.cfg").write_text(GRUB)
    subprocess.run(["grub-mkrescue", "-o", home / "disc.iso", home / "iso"], capture_output=True, check=True)


def run_emulator(home: Path, model: str) -> str:
    """Run the emulator and return its serial output."""
    (home / "bochsrc").write_text(BOCHS_CONFIGURATION.format(model=model, firmware=FIRMWARE))
    (home / "go").write_text("continue\n")  # Debian's Bochs starts in its debugger
    serial = home / "serial.txt"
    # the display of Bochs needs a terminal
    machine = subprocess.Popen(
        ["script", "--quiet", "--command", "bochs -q -f bochsrc -rc go", "/dev/null"],
        cwd=home,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    start, shown = time.monotonic(), 0
    try:
        while time.monotonic() - start < TIMEOUT and machine.poll() is None:
            time.sleep(1.0)
            text = serial.read_text(errors="replace") if serial.exists() else ""
            print(text[shown:], end="", flush=True)
            shown = len(text)
            if "THE END" in text:
                return text
    finally:
        subprocess.run(["pkill", "--session", str(machine.pid)], check=False)
    raise SystemExit(f"the emulator stopped before the tests ended: {home}/bochs.log")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--linux", type=Path, help="Linux image; the newest in /boot by default")
    parser.add_argument("--model", default="corei7_skylake_x", help="see bochs --help cpu")
    options = parser.parse_args()
    linux = options.linux or max(Path("/boot").glob("vmlinuz-*"), default=None)
    missing = [tool for tool in REQUIRED_TOOLS if shutil.which(tool) is None]
    if missing or linux is None:
        raise SystemExit(f"missing: {', '.join(missing) or 'a Linux image, name one with --linux'}\n{__doc__}")
    home = Path(tempfile.mkdtemp(prefix="emulated-"))
    create_disc(home, linux)
    output = run_emulator(home, options.model)
    results = re.findall(r"^(/tests/\S+) ended with (\d+)", output, re.MULTILINE)
    if "v4 as portable" not in output or any(code != "0" for _, code in results):  # printed by the test of the levels
        raise SystemExit(f"tests failed, see {home}/serial.txt")
    shutil.rmtree(home)
    print(f"\n{len(results)} sets of tests passed on {options.model}, at the level v4")


if __name__ == "__main__":
    sys.exit(main())
