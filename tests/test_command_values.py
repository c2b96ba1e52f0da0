"""What `--vary` says becomes the factor that it names; what it cannot be is refused, with near names."""

from __future__ import annotations

import json
import math
import re
import warnings

import numpy as np
import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st
from refusals import refused

from synctrl import Gains, SynctrlError, sweep
from synctrl.cells import schema
from synctrl.cli import codes
from synctrl.cli.answer import answering, code_of
from synctrl.cli.console import readable
from synctrl.cli.laws import LAWS, named_laws
from synctrl.cli.plain import plain
from synctrl.cli.values import FACTORS, read_factor
from synctrl.control.laws import SunMills
from synctrl.errors import InputError, SimulationError
from synctrl.sweep import Choice, Grid, LogUniform, Normal, Uniform

GAINS = Gains(Lambda=10.0, beta=5.0, K_r=4.0, K_eps=2.0, Gamma=0.5)
numbers = st.floats(0.01, 100)


def read(text):
    return read_factor("--vary", text, GAINS)


@given(numbers, st.floats(1.01, 100))
def test_numbers_keep_all_their_digits(low, factor):
    found = read(f"gains.beta=log({low!r},{low * factor!r})")
    assert found.describe() == sweep.gain("beta", LogUniform(low, low * factor)).describe()


@pytest.mark.parametrize(
    ("text", "factor"),
    [
        ("gains.K_eps=uniform(0.1,10)", sweep.gain("K_eps", Uniform(0.1, 10))),
        ("gains.Gamma.scale=normal(1,0.1)", sweep.gain_scale("Gamma", Normal(1, 0.1))),
        (" model_error = uniform( -0.5 , 0.5 ) ", sweep.model_error(Uniform(-0.5, 0.5))),
        ("network.delay=choice(0.01,0.02)", sweep.network_delay(Choice([0.01, 0.02]))),
        ("network_receiver=grid(hold,filter)", sweep.network_receiver(Grid(["hold", "filter"]))),
        ("sensors.velocity_noise=uniform(0,0.1)", sweep.velocity_noise(Uniform(0, 0.1))),
        (
            "true_parameters[robot=1,body=0]=uniform(0.8,1.2)",
            sweep.true_parameters(Uniform(0.8, 1.2), robot=1, body=0),
        ),
        ("control_period=grid(0.002,0.004)", sweep.control_period(Grid([0.002, 0.004]))),
    ],
)
def test_a_text_is_the_factor_that_it_names(text, factor):
    assert read(text).describe() == factor.describe()


def test_laws_vary_by_their_names():
    values = read("law=grid(sun-mills,independent,chung-slotine)").values
    assert [value.partition("(")[0] for value in values.values] == ["SunMills", "SlotineLi", "ChungSlotine"]


@pytest.mark.parametrize("name", FACTORS)
def test_every_factor_of_numbers_can_be_named(name):
    words = {"network_receiver": "grid(hold)", "noise_seed": "grid(1)", "network_seed": "grid(1)"}
    index = "[robot=0]" if name == "network_offset" else ""
    assert name in read(f"{name}{index}={words.get(name, 'uniform(0.1,0.2)')}").describe()["name"]


@pytest.mark.parametrize(
    "text",
    [
        "beta",
        "gains.beta",
        "gains.beta=",
        "gains.beta=5",
        "gains.beta=log(5,150",
        "gains.beta=log(5,150);import os",
        "gains.bta=log(5,150)",
        "gains.beta.half=log(5,150)",
        "gains.beta=logarithm(5,150)",
        "gains.beta=log(5)",
        "gains.beta=log(5,six)",
        "gains.beta=log(150,5)",
        "gains.beta=grid()",
        "model_err=uniform(0,1)",
        "Sweep=uniform(0,1)",
        "__import__=uniform(0,1)",
        "model_error[robot=one]=uniform(0,1)",
        "model_error[joint=0]=uniform(0,1)",
        "control_period[robot=0]=uniform(0.1,1)",
        "law=grid(sunmills)",
        "law=uniform(0,1)",
    ],
)
def test_what_is_no_factor_is_refused(text):
    with refused(InputError):
        read(text)


@given(st.text(max_size=30))
def test_no_text_is_anything_but_a_factor_or_refused(text):
    try:
        read(text)
    except InputError as error:
        assert str(error)


def test_near_names_are_said():
    for text, near in (("gains.bta=log(1,2)", "beta"), ("model_err=uniform(0,1)", "model_error")):
        with refused(InputError, "--vary") as caught:
            read(text)
        assert f"'{near}'" in str(caught.value)


def test_laws_have_the_names_of_cell_files():
    assert isinstance(named_laws(["sun-mills"], GAINS)["sun-mills"], SunMills)
    assert [*named_laws([*LAWS], GAINS)] == [*LAWS]
    kinds = schema()["$defs"]
    words = re.findall(r'"([a-z]+(?:-[a-z]+)+)"', json.dumps(kinds))
    assert {*LAWS} - {"independent"} <= {*words}
    with refused(InputError, "--laws", found="chung"):
        named_laws(["chung"], GAINS)


# -- answers -----------------------------------------------------------------------------------------------


def test_data_of_any_kind_are_json():
    found = plain(
        {"a": np.array([1.0, np.nan]), 2: (np.float64(math.inf), np.int64(3)), "c": None, "d": True}
    )
    assert found == {"a": [1.0, None], "2": [None, 3], "c": None, "d": True}


@given(st.text())
def test_no_text_of_a_file_steers_the_terminal(text):
    assert all(c.isprintable() or c == "\n" for c in readable(text))


def test_each_kind_of_end_has_its_code():
    stopped = SimulationError("the run had to stop", result=object())
    assert code_of(stopped) == codes.STOPPED and code_of(SimulationError("before it began")) == codes.REFUSED
    assert code_of(InputError("no")) == codes.REFUSED and code_of(KeyboardInterrupt()) == codes.INTERRUPTED


def test_a_fault_of_ours_keeps_its_traceback():
    with pytest.raises(ZeroDivisionError), answering(as_json=False):
        1 / 0  # noqa: B018


def test_warnings_are_said_once_each_and_leave_python_s_as_they_were(capsys):
    before = warnings.showwarning
    with answering(as_json=False) as answer:
        for _ in range(3):
            warnings.warn("the step is too long", UserWarning, stacklevel=1)
    assert capsys.readouterr().err == "warning: the step is too long\n"
    assert answer.data["warnings"] == ["the step is too long"] and warnings.showwarning is before


def test_an_error_is_one_line_that_names_what_it_is_about(capsys):
    with pytest.raises(typer.Exit) as caught, answering(as_json=False):
        raise SynctrlError("expected this, found that", subject="dt")
    assert caught.value.exit_code == codes.REFUSED
    assert capsys.readouterr().err == "error: dt: expected this, found that\n"
