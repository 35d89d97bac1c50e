#!/usr/bin/env python3
"""Final states of AVR programs on yasimavr (https://pypi.org/project/yasimavr/), an independent simulator.

    reference.py [--digest] FILE

FILE has one program a line: its flash from address 0, in hexadecimal, ending in a jump to itself. Each runs on a fresh
ATtiny402, whose memory map is that of the ATtiny412. Printed, one line a program: r0...r31, SREG, SP (low byte first), I/O
0x1C...0x1F, SRAM 0x3F00...0x3FFF, in hexadecimal; with --digest, a header and the 64-bit FNV-1a of those bytes.

Install: python3 -m venv VENV && VENV/bin/pip install yasimavr==0.1.6 (compiles for about two minutes, needs libelf-dev).
"""

import argparse
import importlib.metadata

import yasimavr.lib.core as core
from yasimavr.device_library import load_device

# A program has 2 kWords, calls subroutines of ten instructions and takes at most 5 cycles an instruction.
CYCLES = 200_000
HALT = (0xCFFF).to_bytes(2, "little")


def final_state(image):
    """The state in which the program ends, 295 bytes."""
    device = load_device("attiny402")
    probe = core.DeviceDebugProbe(device)
    loop = core.SimLoop(device)
    loop.set_fast_mode(True)
    block = core.Firmware.block_view_t()
    block.bytes = image
    block.base = 0
    firmware = core.Firmware()
    firmware.frequency = 20_000_000
    firmware.vcc = 5.0
    firmware.add_block(core.Firmware.Area.Flash, block)
    device.load_firmware(firmware)
    loop.run(CYCLES)
    pc = probe.read_pc()
    if image[pc : pc + 2] != HALT:
        raise RuntimeError(f"stopped at {pc:#x}, {device.state()}")
    state = bytes(probe.read_gpreg(k) for k in range(32))
    state += bytes([probe.read_sreg()]) + probe.read_sp().to_bytes(2, "little")
    state += bytes(probe.read_ioreg(a) for a in range(0x1C, 0x20))
    state += bytes(probe.read_data(0x3F00, 256))
    probe.detach()
    return state


def fnv1a(data):
    digest = 0xCBF29CE484222325
    for byte in data:
        digest = (digest ^ byte) * 0x100000001B3 % 2**64
    return digest


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--digest", action="store_true", help="FNV-1a of each state")
    arguments = parser.parse_args()
    if arguments.digest:
        version = importlib.metadata.version("yasimavr")
        print("# FNV-1a of the final states of the random programs 0, 1, ... of tests/isa/oracle.rs,")
        print(f"# by oracle/reference.py --digest on yasimavr {version}, ATtiny402.")
    with open(arguments.file, encoding="ascii") as programs:
        for line in programs:
            state = final_state(bytes.fromhex(line.strip()))
            print(f"{fnv1a(state):016x}" if arguments.digest else state.hex())


if __name__ == "__main__":
    main()
