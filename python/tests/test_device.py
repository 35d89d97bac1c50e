"""The virtual device on a pseudo-terminal, read by a host that is written here, and by `spts record`."""

import json
import os
import select
import subprocess
import sys
import time
import tty

import numpy as np
import pytest
import spts

SPTS = [sys.executable, "-m", "spts"]
FIELDS = 100_001


class Device:
    """A virtual device with these options, and its port."""

    def __init__(self, *options):
        self.process = subprocess.Popen(
            [*SPTS, "device", "--pty", "--json", *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.about = json.loads(self.process.stdout.readline())
        self.port = self.about["port"]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()


def lines(port, count, limit=60.0):
    """What a host reads that sends `*` and waits for `count` lines: it knows nothing of this package."""
    device = os.open(port, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(device)
    os.write(device, b"*")
    text, end = b"", time.monotonic() + limit
    while text.count(b"\n") < count:
        assert select.select([device], [], [], end - time.monotonic())[0], "the device is silent"
        text += os.read(device, 65536)
    os.close(device)
    return text.decode().splitlines(keepends=True)[:count]


@pytest.mark.parametrize("mode", ["raster", "analog", "binary"])
def test_a_host_reads_two_blocks(mode):
    with Device("--fast", "--blocks", "2", "--mode", mode) as device:
        assert device.about == {"port": device.port, "mode": mode, "taxels": 100, "blocks": 2}
        said = lines(device.port, 4)
    assert said[:2] == ["Sending.\n", "Sent!.\n"]
    blocks = [line.split(",") for line in said[2:]]
    assert [len(block) for block in blocks] == [FIELDS, FIELDS]
    assert all(block[-1] == " \r\n" for block in blocks)
    codes = np.array([block[1:-1] for block in blocks], int)
    assert codes.min() >= 0 and codes.max() <= 1023
    positions = [int(block[0]) for block in blocks]
    assert 1000 < positions[0] < positions[1] - 1000 < 3000


def test_what_a_host_reads_can_be_decoded(tmp_path):
    """Codes and rows of two blocks by hand, and by `spts record`: the same image, that of a T."""
    for mode, blocks in (("raster", 2), ("binary", 2)):
        with Device("--fast", "--blocks", str(blocks), "--mode", mode) as device:
            said = subprocess.run(
                [
                    *SPTS,
                    "record",
                    "--port",
                    device.port,
                    "--mode",
                    mode,
                    "--object",
                    "T",
                    "--blocks",
                    str(blocks),
                    "--out",
                    tmp_path,
                    "--json",
                ],
                check=True,
                capture_output=True,
                text=True,
            )
        found = json.loads(said.stdout)
        assert found["blocks"] == 2 and found["measurements"] == 100_000 and min(found["signal_v"]) > 0.1
    with Device("--fast", "--blocks", "2") as device:
        said = lines(device.port, 4)
    session = spts.load(tmp_path)
    assert (session.object, session.event, session.shape) == ("T", "press", (10, 10))
    compressive, raster = session.compressive, session.raster
    # the codes by hand are the recorded volts on a straight line, but for the last one, which is never sent
    codes = np.array(said[2].split(",")[1:-1], int)
    volts = compressive.volts[0]
    assert np.isnan(volts[-1]) and np.isfinite(volts[:-1]).all()
    slope, offset = np.polyfit(codes, volts[:-1], 1)
    assert np.allclose(slope * codes + offset, volts[:-1], atol=1e-9)
    truth = raster.volts[0].reshape(1000, 100)[600] - raster.idle[0]
    phi, y = compressive.windows(0, 50)
    image = spts.decode(phi[0], y[0], (10, 10))
    assert spts.iou(image[None], truth.reshape(1, 10, 10))[0] > 0.4


def test_it_takes_its_time():
    """Without `--fast`, a block takes the wait after the touch and the time of its measurements: 1.4 s + 100,000/64,300 Hz."""
    begin = time.monotonic()
    with Device("--blocks", "1") as device:
        lines(device.port, 3)
    assert 2.9 < time.monotonic() - begin < 15.0


def test_what_cannot_be(tmp_path):
    def refused(*words):
        done = subprocess.run([*SPTS, *words], capture_output=True, text=True)
        assert done.returncode == 2, done
        return done.stderr

    assert "--object" in refused("device", "--pty", "--object", "spoon")
    assert "[0.1, 1000]" in refused("device", "--pty", "--force", "0")
    assert "no converter" in refused("device", "--pty", "--readout", "ideal")
    assert str(tmp_path) in refused("device", str(tmp_path), "--pty")
    assert "/dev/null" in refused("record", "--port", "/dev/null", "--out", str(tmp_path / "a"))
    with Device("--fast", "--blocks", "1") as device:
        said = refused("record", "--port", device.port, "--blocks", "2", "--timeout", "2", "--out", str(tmp_path / "a"))
        assert "serial port" in said and "block 1" in said
    # the block before is kept
    assert (tmp_path / "a" / "session.json").exists()
