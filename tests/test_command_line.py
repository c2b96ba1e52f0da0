"""Every command of `synctrl` as a process: what it prints, writes, and with which code it ends."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from synctrl import Experiment, Result, load_robot
from synctrl.analysis import certify, compare
from synctrl.analysis.advise import advise_run
from synctrl.analysis.metrics import as_data, metrics
from synctrl.cli import codes
from synctrl.cli.laws import named_laws
from synctrl.cli.plain import plain
from synctrl.experiments import planar_four
from synctrl.sweep import LogUniform, Sweep, Uniform, gain, model_error

PROGRAM = (sys.executable, "-m", "synctrl")
DURATION = "0.1"
QUICK = ("--duration", DURATION, "--engine", "pinocchio")


def ended(*words: object, code: int = codes.DONE, cwd: Path | None = None, **environment: str):
    """A command that has come to its end, with the code that it has to have, and no traceback."""
    command = [*PROGRAM, *map(str, words)]
    env = {**os.environ, "COLUMNS": "200", **environment}
    done = subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == code, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done


def answer(*words: object, **how) -> dict:
    """What a command answers as JSON: one object, and nothing else on the standard output."""
    return json.loads(ended(*words, "--json", **how).stdout)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a new cell file, and its run."""
    here = tmp_path_factory.mktemp("cell")
    ended("new", here / "cell.toml")
    return here


@pytest.fixture(scope="module")
def made(folder):
    """What the run answers."""
    return answer("run", folder / "cell.toml", "-o", folder / "out", *QUICK)


@pytest.fixture(scope="module")
def experiment(folder):
    return Experiment.from_file(folder / "cell.toml")


@pytest.fixture(scope="module")
def result(experiment):
    return experiment.simulate(float(DURATION))


# -- new, run, show ----------------------------------------------------------------------------------------


def test_a_new_file_is_never_written_over(folder):
    before = (folder / "cell.toml").read_bytes()
    said = ended("new", folder / "cell.toml", code=codes.REFUSED).stderr
    assert said.startswith("error: ") and str(folder / "cell.toml") in said
    assert (folder / "cell.toml").read_bytes() == before


def test_a_ready_cell_is_written_as_a_file_with_its_schema(tmp_path):
    done = answer("new", tmp_path / "four.toml", "--from", "planar_four", "--schema")
    assert [Path(path).name for path in done["written"]] == ["four.toml", "four.schema.json"]
    assert json.loads((tmp_path / "four.schema.json").read_text("utf-8"))["type"] == "object"
    written = Experiment.from_file(tmp_path / "four.toml").simulate(0.01)
    assert np.array_equal(written.q, planar_four().simulate(0.01).q)


def test_a_run_is_that_of_the_library(made, folder, experiment, result):
    saved = Result.load(folder / "out" / "run.npz")
    assert all(np.array_equal(getattr(saved, name), getattr(result, name)) for name in ("t", "q", "tau"))
    assert made["metrics"] == plain(as_data(result, metrics(result)))
    assert made["certificate"] == plain(certify(result).as_dict())
    assert (made["status"], made["engine"], made["warnings"]) == ("completed", "pinocchio", [])


def test_a_run_leaves_a_page_with_an_animation_its_numbers_and_its_cell(made, folder):
    out = folder / "out"
    assert Path(made["page"]) == out / "index.html"
    assert (out / "animation.html").is_file() and [*(out / "figures").iterdir()]
    numbers = json.loads((out / "metrics.json").read_text("utf-8"))
    assert numbers["runs"]["run"] == made["metrics"]
    assert (out / "cell.toml").read_bytes() == (folder / "cell.toml").read_bytes()


def test_a_saved_run_shows_the_same_as_when_it_was_made(made, folder):
    shown = answer("show", folder / "out" / "run.npz", "-o", folder / "shown")
    same = ("metrics", "certificate", "status", "title", "end")
    assert {name: shown[name] for name in same} == {name: made[name] for name in same}
    page = (folder / "shown" / "index.html").read_text("utf-8")
    assert page == (folder / "out" / "index.html").read_text("utf-8")


def test_a_saved_run_is_written_for_other_tools_by_the_endings_of_their_files(made, folder, result, tmp_path):
    files = [tmp_path / f"run{ending}" for ending in (".csv", ".mat")]
    words = (
        "show",
        folder / "out" / "run.npz",
        "--no-page",
        *(x for file in files for x in ("--export", file)),
    )
    assert answer(*words)["exported"] == [str(file) for file in files]
    ours = [result.to_csv(tmp_path / "ours.csv"), result.to_mat(tmp_path / "ours.mat")]
    assert files[0].read_bytes() == ours[0].read_bytes()
    assert files[1].stat().st_size == ours[1].stat().st_size
    refusal = answer("run", folder / "cell.toml", "--export", "run.xlsx", code=codes.REFUSED)["error"]
    assert refusal["subject"] == "--export" and refusal["found"] == "run.xlsx"


def test_without_its_cell_a_saved_run_has_numbers_and_no_certificate(made, folder, tmp_path):
    lonely = tmp_path / "lonely.npz"
    lonely.write_bytes((folder / "out" / "run.npz").read_bytes())
    printed = ended("show", lonely, "--no-page").stdout
    assert "left" in printed and "No certificate" in printed and "--cell" in printed
    assert [path.name for path in tmp_path.iterdir()] == ["lonely.npz"]


def test_a_run_that_has_to_stop_is_written_as_far_as_it_came(folder, tmp_path):
    text = (folder / "cell.toml").read_text("utf-8").replace("K_r = 5.0", "K_r = 5e4")
    (tmp_path / "stiff.toml").write_text(text, "utf-8")
    words = ("run", tmp_path / "stiff.toml", "-o", tmp_path / "out", "--no-page", *QUICK)
    found = answer(*words, code=codes.STOPPED)
    assert found["error"]["kind"] == "NonFiniteError"
    saved = Result.load(tmp_path / "out" / "run.npz")
    assert saved.status != "completed" and saved.t[-1] == found["end"] < float(DURATION)


def test_a_run_replaces_no_cell_file_but_its_own_copy(folder, tmp_path):
    mine, other = tmp_path / "cell.toml", tmp_path / "other.toml"
    mine.write_text("# mine\n", "utf-8")
    other.write_text((folder / "cell.toml").read_text("utf-8"), "utf-8")
    words = ("run", other, "--no-page", *QUICK)
    assert answer(*words, "-o", tmp_path, code=codes.REFUSED)["error"]["subject"] == "--out"
    assert mine.read_text("utf-8") == "# mine\n" and not (tmp_path / "run.npz").exists()
    for _ in range(2):
        ended(*words, "-o", tmp_path / "out")
    ended("run", tmp_path / "out" / "cell.toml", "--no-page", *QUICK, "-o", tmp_path / "out")
    assert (tmp_path / "out" / "cell.toml").read_bytes() == other.read_bytes()


def test_a_folder_that_cannot_be_written_is_refused_before_the_run(folder):
    found = answer("run", folder / "cell.toml", "-o", folder / "cell.toml", *QUICK, code=codes.REFUSED)
    assert found["error"]["kind"] == "ResultError" and "metrics" not in found


def test_advice_is_that_of_the_library_and_changes_the_gains_in_a_file(folder, experiment, tmp_path):
    text = (folder / "cell.toml").read_text("utf-8").replace("K_r = 5.0", "K_r = 5e4")
    (tmp_path / "stiff.toml").write_text(text, "utf-8")
    words = ("advise", tmp_path / "stiff.toml", "--write", tmp_path / "advised.toml")
    found = answer(*words, code=codes.FOUND_WANTING)
    assert (
        found["changes"]
        == plain(advise_run(Experiment.from_file(tmp_path / "stiff.toml")).to_dict())["changes"]
    )
    advised = Experiment.from_file(tmp_path / "advised.toml")
    assert advised.gains.as_dict() == found["changed_gains"] != experiment.gains.as_dict()
    assert advised.simulate(float(DURATION)).status == "completed"


# -- progress and Ctrl-C -----------------------------------------------------------------------------------


def told(screen: int, what: str, process: subprocess.Popen, limit: float = 120.0) -> str:
    """What a process has drawn when it comes to match a pattern."""
    drawn, end = "", time.monotonic() + limit
    while time.monotonic() < end and process.poll() is None:
        if select.select([screen], [], [], 0.5)[0]:
            drawn += os.read(screen, 65536).decode("utf-8", "replace")
        if re.search(what, re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", drawn)):
            return drawn
    raise AssertionError(f"{what!r} was not drawn: {drawn[-500:]!r}")


@pytest.mark.skipif(sys.platform == "win32", reason="terminals of Windows are others")
def test_a_terminal_shows_the_time_left_and_ctrl_c_keeps_what_was_computed(folder, tmp_path):
    screen, terminal = pty.openpty()
    words = ["run", str(folder / "cell.toml"), "-o", str(tmp_path), "--no-page", "--duration", "10000"]
    env = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    process = subprocess.Popen(
        [*PROGRAM, *words, "--engine", "pinocchio"],
        env=env,
        stdout=subprocess.PIPE,
        stderr=terminal,
        text=True,
    )
    try:
        told(screen, r"[1-9]/10000 s.*left: \d+:\d\d:\d\d", process)
        process.send_signal(signal.SIGINT)
        printed, _ = process.communicate(timeout=120)
    finally:
        process.kill()
        os.close(terminal)
        os.close(screen)
    assert process.returncode == codes.INTERRUPTED
    saved = Result.load(tmp_path / "run.npz")
    assert saved.status != "completed" and saved.t[-1] > 0
    assert "Robots" in printed and "Traceback" not in printed


# -- many runs ---------------------------------------------------------------------------------------------


def test_a_sweep_has_the_rows_of_the_library_and_goes_on_where_it_was(folder, experiment):
    ranges = ("--vary", "gains.beta=log(5,50)", "--vary", "model_error=uniform(-0.5,0.5)")
    words = ("sweep", folder / "cell.toml", *ranges, "-o", folder / "sweep", "--workers", 1, *QUICK)
    found = answer(*words, "--samples", 3, "--backend", "serial")
    factors = [gain("beta", LogUniform(5, 50)), model_error(Uniform(-0.5, 0.5))]
    same = Sweep(experiment, factors, samples=3, duration=float(DURATION), engine="pinocchio")
    rows = {row["run"]: row for row in found["best"]}
    assert rows[1] == plain(same.run_one(1))
    assert [row["sync_rms"] for row in found["best"]] == sorted(row["sync_rms"] for row in rows.values())
    assert (found["runs"], found["endings"]) == (3, {"completed": 3})
    lines = (folder / "sweep" / "runs.jsonl").read_bytes()
    printed = ended(*words, "--samples", 3, "--backend", "serial").stdout
    assert "3 of 3 runs" in printed and (folder / "sweep" / "runs.jsonl").read_bytes() == lines


def test_a_sweep_of_which_no_run_comes_to_its_end_says_why(folder, tmp_path):
    words = (
        "sweep",
        folder / "cell.toml",
        "--vary",
        "model_error[robot=9]=uniform(0,1)",
        "-o",
        tmp_path / "out",
    )
    printed = ended(*words, "--samples", 2, "--backend", "serial", *QUICK, code=codes.FOUND_WANTING).stdout
    rows = [json.loads(line) for line in (tmp_path / "out" / "runs.jsonl").read_text("utf-8").splitlines()]
    columns = json.loads((tmp_path / "out" / "sweep.json").read_text("utf-8"))["columns"]
    (cause,) = {row[columns.index("cause")] for row in rows}
    assert " ".join(f"{cause} (2 times)".split()) in " ".join(printed.split())


def test_tuning_writes_a_cell_with_what_it_found(folder):
    words = ("tune", folder / "cell.toml", "--search", "gains.beta=log(5,50)", "-o", folder / "tune", *QUICK)
    found = answer(*words, "--generations", 1, "--population", 5, "--workers", 1)
    assert 5 <= found["values"]["beta"] <= 50
    assert found["measures"]["sync_rms"] == min(row["sync_rms"] for row in found["front"])
    tuned = Experiment.from_file(folder / "tune" / "tuned.toml")
    assert np.all(tuned.gains.beta == found["values"]["beta"])


def test_laws_are_compared_as_the_library_does(folder, experiment):
    words = ("compare", folder / "cell.toml", "--laws", "sun-mills,independent", "--equal", "pole")
    found = answer(*words, "-o", folder / "compare", *QUICK)
    laws = named_laws(["independent"], experiment.gains)
    same = compare(experiment, laws, ["equal pole"], duration=float(DURATION)).as_dict()
    assert found["rows"][1] == plain(same)["rows"][1]
    assert [row["law"] for row in found["rows"]] == ["sun-mills", "independent"]
    assert (folder / "compare" / "comparison.png").read_bytes().startswith(b"\x89PNG")


# -- robots, the installation, completion ------------------------------------------------------------------


def test_what_is_read_of_a_robot_is_told_and_drawn(tmp_path):
    found = answer("inspect", "planar2r", "-o", tmp_path)
    robot = load_robot("planar2r")
    assert [joint["name"] for joint in found["joints"]] == list(robot.joint_names)
    assert found["moving_mass"] == sum(joint["mass"] for joint in found["joints"])
    assert {reading["library"].split()[0]: reading["agrees"] for reading in found["readings"]}["yourdfpy"]
    assert {path.name for path in tmp_path.iterdir()} == {"planar2r.png", "planar2r.html"}


def test_a_robot_that_is_refused_is_said_with_its_line():
    file = Path(__file__).parent / "cases" / "urdf" / "no_inertia_anywhere.urdf"
    found = answer("inspect", file, code=codes.REFUSED)
    assert found["error"]["kind"] == "RobotError" and found["error"]["file"] == str(file)


def test_the_doctor_finds_everything_that_everybody_needs():
    found = {each["what"]: each for each in answer("doctor", "--no-trial")["findings"]}
    assert {found[name]["state"] for name in ("Python", "synctrl", "robots")} == {"ok"}
    assert not any(each["wanting"] for each in found.values())


def test_a_cache_that_others_may_write_to_is_found(tmp_path):
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache").chmod(0o777)
    found = answer("doctor", "--no-trial", SYNCTRL_CACHE=str(tmp_path / "cache"))["findings"]
    assert {each["what"]: each["state"] for each in found}["cache"] == "wrong"


def test_a_shell_completes_names():
    asked = {"_SYNCTRL_COMPLETE": "complete_bash", "COMP_WORDS": "synctrl inspect plan", "COMP_CWORD": "2"}
    assert ended(**asked).stdout.split() == ["planar2r"]


def test_reproducing_refuses_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    words = ("reproduce", "-o", tmp_path / "file" / "out")
    assert answer(*words, code=codes.REFUSED)["error"]["kind"] == "ResultError"


@pytest.mark.parametrize(
    "words", [("nosuch",), ("run",), ("sweep", "cell.toml"), ("run", "x", "--dt", "fast")]
)
def test_a_wrong_command_line_says_how_it_is_used(words):
    assert "Usage: synctrl" in ended(*words, code=codes.USAGE).stderr
