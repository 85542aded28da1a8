"""Small virtual records and unit folders for the tests of reading, checking and the command line."""

import gzip
import os
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

SHARED = Path(__file__).resolve().parents[1] / ".." / "shared"
os.environ["COLUMNS"] = "120"
LONGEST_FIRST = ("test_api.py", "docs", "decisions", "records", "fleet", "gap", "blind", "engine", "figures", "report", "pooling")
"""Files and folders of tests in the order in which they are begun: no core is to wait for a long one at the end, and while
the first file has its functions compiled, the other core runs tests that need none of them instead of compiling them too."""
FULL_CYCLE = (0.0, 1.0, -1.0, 1.0)


def pytest_configure():
    """A shell that runs the tests in the background has them ignore Ctrl-C, and so would every command that they start."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items):
    """The longest first; those of one file stay together."""
    order = {name: place for place, name in enumerate(LONGEST_FIRST)}
    tests = Path(__file__).parent
    items.sort(key=lambda item: order.get(item.path.relative_to(tests).parts[0], len(order)))


def ramps(knots=FULL_CYCLE, *, rate=1.0, hertz=200.0, dwell=0.0, limit=np.inf, noise=0.0, seed=0):
    """Time and torque of straight ramps between ``knots``, resting ``dwell`` seconds at each."""
    times, levels = [0.0], [knots[0]]
    for before, after in zip(knots[:-1], knots[1:], strict=True):
        times += [times[-1] + abs(after - before) / rate, times[-1] + abs(after - before) / rate + dwell]
        levels += [after, after]
    time = np.arange(0.0, times[-1] + 0.5 / hertz, 1.0 / hertz)
    torque = np.clip(np.interp(time, times, levels), -limit, limit)
    return time, torque + noise * np.random.default_rng(seed).normal(size=len(time))


def answer(torque, *, gap=0.2, compliance=0.01, clearance=0.02):
    """Angle of a clearance crossed at drag ``gap``, in series with a soft spring: curved and hysteretic."""
    play, position = np.empty_like(torque), 0.0
    for k, level in enumerate(torque):
        position = min(max(position, level - gap), level + gap)
        play[k] = position
    return compliance * torque + clearance * np.tanh(play / 0.1)


def write_csv(path, time, torque, angle, header="time_s,torque_Nm,angle_arcmin"):
    rows = "\n".join(f"{t:.6f},{q:.6f},{a:.6f}" for t, q, a in zip(time, torque, angle, strict=True))
    data = f"{header}\n{rows}\n".encode()
    path.write_bytes(gzip.compress(data) if path.name.endswith(".gz") else data)
    return path


@pytest.fixture
def few_draws(monkeypatch):
    """Posteriors of few draws, said not to have converged, for tests of what is said and written."""
    from backdrive_bayes.engine import sample

    for name in ("FIRST_STEPS", "MOST_STEPS"):
        monkeypatch.setattr(sample, name, 3)


@pytest.fixture
def unit_folder(tmp_path):
    """A valid unit of one record; tests spoil one thing of it."""
    folder = tmp_path / "unit"
    folder.mkdir()
    time, torque = ramps(noise=0.01)
    angle = answer(torque) * 10800 / np.pi + 0.1 * np.random.default_rng(1).normal(size=len(time))
    write_csv(folder / "a.csv", time, torque, angle)
    (folder / "unit.toml").write_text(
        'schema = "backdrive-bayes/unit/1"\nname = "u"\nrated_torque_Nm = 1.0\n\n[[record]]\nfile = "a.csv"\n'
    )
    return folder


@pytest.fixture(scope="session")
def shared_data():
    folder = SHARED / "data"
    if not folder.is_dir():
        pytest.skip("the shared bench data are not on this machine")
    return folder.resolve()


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 256 kB and a function that makes it read-only."""
    room = tmp_path / "disk"
    room.mkdir()
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(room)], capture_output=True, text=True)
    if made.returncode:
        pytest.skip(f"a file system of its own needs the right to mount ({made.stderr.strip()})")
    yield room, lambda: subprocess.run(["mount", "-o", "remount,ro", str(room)], check=True)
    subprocess.run(["umount", "-l", str(room)], check=True)


@pytest.fixture(scope="module")
def blank_pictures():
    """For reports whose words are read: pictures keep their sizes and captions but are not drawn."""
    from backdrive_bayes.figures import catalogue

    def save(figure, path):
        wide, high = 72.0 * figure.get_size_inches()
        path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.2f}pt" height="{high:.2f}pt"/>', encoding="utf-8")
        return path

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(catalogue, "save_svg", save)
        for module in ("catalogue", "diagnosis"):
            patch.setattr(f"backdrive_bayes.figures.{module}.settled", lambda figures: figures)
        yield
