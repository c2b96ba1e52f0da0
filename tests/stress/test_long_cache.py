"""Long versions: the cache under kills, damage and crowds, and the check on every arm of the catalogue."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from machines import random_robot

from synctrl import (
    CartesianSpace,
    Cell,
    Coupling,
    Experiment,
    Gains,
    Hold,
    JointSpace,
    Member,
    PoseSpace,
    load_robot,
)
from synctrl.compiled import build, cache, program
from synctrl.compiled.program import Program
from synctrl.errors import CompilationError
from synctrl.robots.catalog import catalog_names
from synctrl.robots.parameters import planar_two_link_parameters

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")

GAINS = Gains(4.0, 4.0, 10.0, 1.0, 0.1)
SOURCE = "int answer(void) { return 42; }"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    path = tmp_path / "cache"
    monkeypatch.setenv("SYNCTRL_CACHE", str(path))
    monkeypatch.setattr(build, "_CHECKED", {})
    return path


@pytest.fixture
def differences(monkeypatch):
    """The differences that the check has found, relative, in parts of y'."""
    found: list[float] = []
    agree = program._agree

    def watch(expected, computed):
        for a, b in zip(expected, computed, strict=True):
            found.append(float(np.abs(b - a).max(initial=0.0) / (1 + np.abs(a).max(initial=0.0))))
        agree(expected, computed)

    monkeypatch.setattr(program, "_agree", watch)
    return found


def ring(name: str, n: int, q0: np.ndarray, axes: str, **options) -> Experiment:
    arm = load_robot(name)
    members = []
    for i in range(n):
        robot = arm.placed((1.5 * i, 0.0, 0.0))
        hold = Hold(robot.tip_position(q0)[: len(axes)])
        parameters = planar_two_link_parameters(robot) if name == "planar2r" else None
        members.append(Member(robot, hold, q0, parameters=parameters, **options))
    return Experiment(Cell(members, Coupling.signed_ring(n), CartesianSpace(axes)), GAINS, 0.005)


LARGE = {
    "1,000 UR5": ("ur5", 1000, np.array([0.3, -1.2, 1.5, -0.5, 0.4, 0.2]), "xyz"),
    "2,000 planar arms": ("planar2r", 2000, np.array([0.5, 1.2]), "xy"),
}


@pytest.mark.parametrize("name", LARGE)
def test_large_cells_compile_on_an_empty_cache_and_run(name, differences, record_property):
    result = ring(*LARGE[name]).simulate(engine="compiled")
    assert result.status == "completed"
    assert len(differences) == 3 * 4
    record_property("figure", f"{name}: code differs from Pinocchio by {max(differences):.1g} at most")


def cells(name: str):
    """An arm of the catalogue in every space that it has."""
    robot = load_robot(name)
    q0 = 0.3 + 0.1 * np.arange(robot.nv)
    spaces = [JointSpace(), *([CartesianSpace("xy")] if robot.nv >= 2 else [])]
    spaces += [CartesianSpace()] if robot.nv >= 3 else []
    spaces += [PoseSpace()] if robot.nv >= 6 else []
    for space in spaces:
        m = len(space.labels([robot]))
        members = [Member(robot, Hold(np.zeros(m)), q0) for _ in range(2)]
        yield Experiment(Cell(members, Coupling.pair(), space), GAINS, 0.01)


def test_every_arm_of_the_catalogue_passes_the_check(differences, record_property):
    count = 0
    for name in catalog_names():
        for experiment in cells(name):
            Program(experiment.closed_loop())
            count += 1
    record_property(
        "figure",
        f"{count} cells of {len(catalog_names())} arms: differences of {max(differences):.1g} at most",
    )


def test_machines_that_nobody_chose_pass_the_check(differences, record_property):
    for seed in range(40):
        robots = [random_robot(2 * seed + k, joints=2 + seed % 5, chain=True) for k in range(2)]
        members = [Member(robot, Hold(np.zeros(robot.nv))) for robot in robots]
        Program(Experiment(Cell(members, Coupling.pair()), GAINS, 0.01).closed_loop())
    record_property("figure", f"40 cells of random machines: differences of {max(differences):.1g} at most")


def test_builds_that_are_killed_leave_nothing_that_stays_or_is_run(folder, record_property):
    """Processes build the same four libraries at once; two of three are killed, sooner or later."""
    rng = np.random.default_rng(0)
    code = (
        "from synctrl.compiled import build\nprint('ready', flush=True)\n"
        "for k in range(4):\n"
        "    source = f'int answer(void) {{ return {k}; }}'\n"
        "    library = build.cached_library(f'key{k}', lambda: iter([source]), lambda library: None)\n"
        "    assert library.answer() == k\n"
    )
    killed = 0
    for _ in range(20):
        command = [sys.executable, "-c", code]
        processes = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(3)]
        assert all(process.stdout.readline() == "ready\n" for process in processes)
        for process in processes[:2]:
            try:
                process.wait(float(rng.uniform(0.0, 0.5)))
            except subprocess.TimeoutExpired:
                process.kill()
                killed += 1
        for process in processes:
            process.communicate()
        assert processes[2].returncode == 0
        for path in list(folder.glob("key*"))[::3]:
            path.unlink()
    cache.remove_leftovers(folder)
    assert not list(folder.glob(f"{cache.BUILDING}*"))
    subprocess.run([sys.executable, "-c", code], check=True)
    record_property(
        "figure", f"{killed} of 40 processes killed while they built, none of the others wrong, nothing left"
    )


def damaged(rng: np.random.Generator, content: bytes) -> bytes:
    """A file that was cut, filled with zeros, doubled, or changed in one bit."""
    kind, place = rng.integers(4), int(rng.integers(max(1, len(content))))
    if kind == 0:
        return content[:place]
    if kind == 1:
        return content[:place] + bytes(len(content) - place)
    if kind == 2:
        return content + content[place:]
    changed = bytearray(content)
    changed[place] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def test_files_that_are_damaged_are_built_again(folder, monkeypatch, record_property):
    rng, runs = np.random.default_rng(0), 300
    for k in range(runs):
        build.cached_library("key", lambda: iter([SOURCE]), lambda library: None)
        for name in ("key.so", "key.sha256")[: 1 + k % 2]:
            path = folder / name
            path.write_bytes(damaged(rng, path.read_bytes()))
        monkeypatch.setattr(build, "_CHECKED", {})
        library = build.cached_library("key", lambda: iter([SOURCE]), lambda library: None)
        assert library.answer() == 42
    record_property("figure", f"{runs} damaged entries: all of them built again")


def test_every_cut_of_a_real_library_is_noticed(folder, record_property):
    Program(ring("planar2r", 3, np.array([0.5, 1.2]), "xy").closed_loop())
    (library,) = folder.glob("*.so")
    whole = library.read_bytes()
    assert build.is_whole(whole)
    assert not any(build.is_whole(whole[:k]) for k in range(len(whole)))
    record_property("figure", f"{len(whole):,} cuts of a library under a digest that fits: none was loaded")


def test_headers_of_any_content_are_judged_without_an_error(folder, record_property):
    build.cached_library("key", lambda: iter([SOURCE]), lambda library: None)
    whole, rng, taken = (folder / "key.so").read_bytes(), np.random.default_rng(0), 0
    for _ in range(20_000):
        changed = bytearray(whole)
        for place in rng.integers(4, 400, size=4):
            changed[place] = int(rng.integers(256))
        taken += build.is_whole(bytes(changed))
    record_property("figure", f"20,000 mutated headers: no error, {20_000 - taken:,} refused")


def test_threads_that_want_one_library_at_once_get_it(folder, record_property):
    def fetch(k):
        key, answer = f"key{k % 5}", k % 5
        source = f"int answer(void) {{ return {answer}; }}"
        library = build.cached_library(key, lambda: iter([source]), lambda library: None)
        return library.answer() == answer

    with ThreadPoolExecutor(16) as pool:
        assert all(pool.map(fetch, range(400)))
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        f"key{k}{suffix}" for k in range(5) for suffix in (".so", ".sha256")
    )
    record_property("figure", "400 requests of 16 threads for 5 libraries: all right")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files to other users")
def test_no_mode_in_which_others_may_write_is_taken(folder, record_property):
    build.cached_library("key", lambda: iter([SOURCE]), lambda library: None)
    refused = 0
    for path in (folder, folder / "key.so", folder / "key.sha256"):
        own = path.stat().st_mode
        for bits in range(0o10000):
            path.chmod(bits)
            if bits & 0o022:
                with refused(CompilationError, found="can be written by others"):
                    build.cached_library("key", lambda: iter([SOURCE]), lambda library: None)
                refused += 1
        path.chmod(own)
    shutil.rmtree(folder)
    record_property("figure", f"{refused:,} modes in which others may write: all refused")
