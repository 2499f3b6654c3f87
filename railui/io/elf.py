"""Shared libraries of Linux (ELF, 64 bit): their processor, and references that may stay unresolved."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Final, NamedTuple

MAGIC: Final = b"\x7fELF\x02\x01"  # 64 bit, little-endian
MACHINES: Final = {62: "x86_64", 183: "aarch64"}  # e_machine
DYNAMIC_SYMBOLS: Final = 11  # sh_type SHT_DYNSYM
GLOBAL, WEAK = 1, 2  # binding of a symbol, the upper half of st_info
SECTION: Final = struct.Struct("<IIQQQQIIQQ")
SYMBOL: Final = struct.Struct("<IBBHQQ")


class _Section(NamedTuple):
    name: int
    kind: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    info: int
    alignment: int
    entry_size: int


def library_machine(library: bytes) -> str:
    """Return the processor of a shared library: x86_64 or aarch64.

    Raises
    ------
    ValueError
        For a file that is no library of Linux for these.
    """
    machine = MACHINES.get(int.from_bytes(library[18:20], "little"))
    if library[: len(MAGIC)] != MAGIC or machine is None:
        raise ValueError(f"not a shared library of 64-bit Linux for {' or '.join(MACHINES.values())}")
    return machine


def with_optional_symbols(library: bytes, is_optional: Callable[[str], bool]) -> bytes:
    """Return a library that loads where some of the symbols it refers to do not exist: they become weak.

    A weak symbol without a definition has the address 0 (System V ABI, Symbol Table).

    Parameters
    ----------
    library : bytes
    is_optional : callable
        Of the name of an undefined symbol.

    Raises
    ------
    ValueError
        As `library_machine`.
    """
    library_machine(library)
    changed = bytearray(library)
    sections = _sections(library)
    for table in (section for section in sections if section.kind == DYNAMIC_SYMBOLS):
        names = sections[table.link].offset
        for at in range(table.offset, table.offset + table.size, SYMBOL.size):
            name, info, _, section, _, _ = SYMBOL.unpack_from(library, at)
            text = library[names + name : library.index(0, names + name)].decode()
            if section == 0 and info >> 4 == GLOBAL and is_optional(text):
                changed[at + 4] = WEAK << 4 | info & 15
    return bytes(changed)


def _sections(library: bytes) -> list[_Section]:
    (offset,) = struct.unpack_from("<Q", library, 0x28)  # e_shoff
    count = int.from_bytes(library[0x3C:0x3E], "little")  # e_shnum
    return [_Section(*SECTION.unpack_from(library, offset + i * SECTION.size)) for i in range(count)]
