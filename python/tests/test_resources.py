"""Memory that stays flat, threads that run side by side, types that fit."""

import os
import subprocess
import sys
import threading
import time

import spts

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def resident_mb():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def test_memory_stays_flat():
    """A hundred thousand touches and what comes of them; `scripts/python_speed.py --leak` does a million."""
    skin, ball = spts.Skin(10, 10, 0.015), spts.Body.sphere(0.03)
    wire = spts.Wire(skin)

    def work(count):
        for k in range(count):
            touch = skin.touch({ball: ((0.0, 0.0, 0.028), UPRIGHT)}, {ball: (0.0,) * 6}, 1e-3)
            if k % 10 == 0:
                y, phi = wire.record(touch, 20)
            if k % 100 == 0:
                spts.decode(phi, y, (10, 10))

    work(5000)
    before = resident_mb()
    work(100_000)
    assert resident_mb() - before < 3.0


def test_other_threads_go_on():
    """The interpreter's lock is not held while a touch is computed or a wire measures: another thread counts meanwhile.

    How much faster two threads are than one, `scripts/python_speed.py` says.
    """
    skin, ball = spts.Skin(10, 10, 0.015), spts.Body.sphere(0.03)
    touch = skin.touch({ball: ((0.0, 0.0, 0.028), UPRIGHT)})
    wire, counted, ended = spts.Wire(skin), 0, threading.Event()

    def work():
        wire.record(touch, 10_000_000, weights=False)
        ended.set()

    thread = threading.Thread(target=work)
    thread.start()
    while not ended.is_set():
        counted += 1
    thread.join()
    # without a lock in between, a second and more of it; with one, the few rounds before the call begins
    assert counted > 100_000


def test_types_are_those_of_the_module(tmp_path):
    words = [sys.executable, "-m", "mypy.stubtest", "--ignore-missing-stub", "spts._spts"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_every_public_name_is_explained():
    """Docstrings, and of what can be called the arguments."""
    import inspect

    for name in spts.__all__:
        thing = getattr(spts, name)
        assert (inspect.getdoc(thing) or "").strip(), name
        if inspect.isclass(thing) and thing.__module__ == "spts":
            for part, member in vars(thing).items():
                if not part.startswith("_"):
                    assert (inspect.getdoc(member) or "").strip(), f"{name}.{part}"


def test_a_call_is_stopped_by_ctrl_c():
    import signal

    call = "import spts; s = spts.Skin(); b = spts.Body.sphere(0.03); t = s.touch({b: ((0, 0, .028), (1, 0, 0, 0))}); print('go', flush=True); spts.Wire(s).record(t, 2**27, weights=False)"
    run = subprocess.Popen([sys.executable, "-c", call], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert run.stdout.readline() == "go\n"
    time.sleep(0.3)
    begin = time.monotonic()
    run.send_signal(signal.SIGINT)
    assert "KeyboardInterrupt" in run.communicate(timeout=30)[1]
    assert time.monotonic() - begin < 2.0
