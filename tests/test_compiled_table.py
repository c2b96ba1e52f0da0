"""The table of quantities, and what follows from it: symbols, structures, lists of the driver, and arrays."""

from __future__ import annotations

import subprocess
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cells import SMALL_GAINS, small_cell
from refusals import refused

from synctrl import CartesianSpace, Cell, Experiment
from synctrl.compiled import structs
from synctrl.compiled.address import CALLBACK
from synctrl.compiled.arrays import _constants
from synctrl.compiled.compiler import compiler
from synctrl.compiled.header import declared, functions_of, header, largest, vectors
from synctrl.compiled.kind import classify
from synctrl.compiled.program import Program
from synctrl.compiled.quantities import (
    FUNCTIONS,
    LOGS,
    QUANTITIES,
    SIZES,
    checked,
    columns,
    owned_by,
    shape,
)
from synctrl.compiled.trace import Trace
from synctrl.control.adaptation import Natural
from synctrl.errors import CompilationError
from synctrl.experiments import a460_pair, bead_on_edge, mixed_four, panda_four, planar_four, rigid_object
from synctrl.simulation.result import LAYOUT

pytest.importorskip("casadi", reason="CasADi is an extra: pip install 'synctrl[compiled]'")


def learning_otherwise() -> Experiment:
    """An adaptation whose state is not theta_hat."""
    experiment = a460_pair()
    return replace(experiment, gains=replace(experiment.gains, Gamma=None), adaptation=Natural(0.1))


def damped() -> Experiment:
    """A space that damps singular configurations."""
    cell = small_cell()
    return Experiment(
        Cell(cell.members, cell.coupling, CartesianSpace("xy", singularity="damped")), SMALL_GAINS, 0.05
    )


EXPERIMENTS = {
    "planar arms": planar_four,
    "joints": a460_pair,
    "poses": rigid_object,
    "poses that slide": bead_on_edge,
    "redundant arms": panda_four,
    "damping in task space": lambda: planar_four(k_r_space="task"),
    "two kinds": mixed_four,
    "damped": damped,
    "another adaptation": learning_otherwise,
}


def kinds_of(name: str):
    return classify(EXPERIMENTS[name]().closed_loop()).kinds


# -- the table and the generated functions ----------------------------------------------------------------


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_generated_functions_have_the_arguments_and_results_of_the_table(name):
    for kind in kinds_of(name):
        made = {function.name(): function for function in Trace(kind, "kind").functions()}
        assert {f"kind_{function}" for function in functions_of(kind)} == set(made)
        for function in functions_of(kind):
            found, (inputs, outputs) = made[f"kind_{function}"], FUNCTIONS[function]
            sizes = [columns(quantity, kind.sizes) for quantity in (*inputs, *outputs)]
            assert (*found.name_in(), *found.name_out()) == (*inputs, *outputs)
            numbers = [found.nnz_in(k) for k in range(found.n_in())]
            numbers += [found.nnz_out(k) for k in range(found.n_out())]
            assert numbers == sizes


def test_a_function_is_given_only_what_is_there_before_it_is_called():
    known = {*owned_by("state", "cell", "instant", "load", "disturbance"), "moving"}
    known |= {"z_sampled", "z_dot_sampled", "since"}  # by the driver, at a sample
    known |= {"sine", "cosine"}  # by the driver, if hands ask for them before a robot is measured
    known |= {"lift"}  # added up by the driver, of what the hands give
    for name, (inputs, outputs) in FUNCTIONS.items():
        shares = {"E", "sigma", "sigma_dot"} if name == "control" else set()  # by the coupling
        assert set(inputs) <= known | shares, name
        assert {QUANTITIES[output].owner for output in outputs} <= {"work", "rate"}
        known |= set(outputs)


def test_every_quantity_is_written_by_one_function_at_most_and_used():
    written = Counter(name for _, outputs in FUNCTIONS.values() for name in outputs)
    assert set(written.values()) == {1}
    files = Path(structs.__file__).parent.glob("*.c")
    driver = "".join(file.read_text(encoding="utf-8") for file in files)
    used = {name for inputs, outputs in FUNCTIONS.values() for name in (*inputs, *outputs)} | set(
        LOGS.values()
    )
    assert [name for name in QUANTITIES if name not in used and f"a->{name}" not in driver] == []


def test_a_rate_has_the_shape_of_its_state_and_the_place():
    states, rates = owned_by("state"), owned_by("rate")
    assert rates == [f"{name}_dot" for name in states]
    assert [QUANTITIES[name][1:3] for name in states] == [QUANTITIES[name][1:3] for name in rates]


def test_every_array_of_a_result_is_logged_from_a_quantity_of_its_dimensions():
    own = "plant_state", "network_state"
    dimension = {"robot": "n", "pair": "p", "axis": "m", "joint": "nv", "parameter": "P"}
    states = "adaptation_state", "damping", "velocity_lost", *own
    devices = "measured_q", "measured_v", "actuator_torque"
    assert [*LOGS] == [*[*LAYOUT][1:], *states, *devices]
    for name, (dimensions, _) in [*LAYOUT.items()][1:]:
        rows, length = (dimension[each] for each in dimensions[1:])
        assert QUANTITIES[LOGS[name]][1:3] == (rows, length), name
    assert all(QUANTITIES[LOGS[name]][1:3] == ("n", "nv") for name in devices)


# -- the table and the driver -----------------------------------------------------------------------------


def printed(source: str, folder: Path) -> str:
    """What a program in C prints."""
    file = folder / "program.c"
    file.write_text(source, encoding="utf-8")
    subprocess.run([*compiler(), str(file), "-o", str(folder / "program")], check=True, timeout=120)
    return subprocess.run([folder / "program"], check=True, timeout=20, capture_output=True, text=True).stdout


def test_structures_have_the_same_layout_in_c_and_in_python(tmp_path):
    places, expected = [], []
    for structure in structs.STRUCTURES:
        title = structure.__name__
        places.append(f"sizeof({title})")
        expected.append(structs.ctypes.sizeof(structure))
        for field in (name for name, *_ in structure._fields_):
            places += [f"offsetof({title}, {field})", f"sizeof((({title} *)0)->{field})"]
            expected += [getattr(structure, field).offset, getattr(structure, field).size]
    declarations = vectors(1) + CALLBACK + "".join(map(declared, structs.STRUCTURES))
    lines = "".join(f'    printf("%zu\\n", {place});\n' for place in places)
    source = f"#include <stddef.h>\n#include <stdio.h>\n{declarations}int main(void) {{\n{lines}}}\n"
    assert [int(line) for line in printed(source, tmp_path).split()] == expected


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_the_driver_counts_columns_as_python_does(name, tmp_path):
    kinds = kinds_of(name)
    owners = dict.fromkeys(quantity.owner.upper() for quantity in QUANTITIES.values())
    text = header(kinds).partition("static const Kind kinds[]")[0]
    lists = "".join(f"    {owner}(COUNT)\n" for owner in owners)
    count = '#define COUNT(name, rows, columns) printf(#name " %d\\n", (int)(columns));\n'
    source = f"#include <stdio.h>\n{text}{count}int main(void) {{\n{lists}}}\n"
    found = dict(line.split() for line in printed(source, tmp_path).splitlines())
    assert found == {name: str(columns(name, largest(kinds))) for name in QUANTITIES}


# -- the table and the arrays -----------------------------------------------------------------------------

SMALL = dict(
    zip(
        (*SIZES, "n", "p", "o", "r", "h"),
        (2, 3, 5, 7, 3, 30, 1, 1, 1, 1, 2, 16, 1, 1, 4, 6, 1, 9, 14),
        strict=True,
    )
)


@pytest.mark.parametrize("name", QUANTITIES)
def test_an_array_of_another_shape_is_refused_by_name(name):
    rows, length = shape(name, SMALL)
    assert checked(name, np.ones((5, rows, length)), SMALL).shape == (5, rows, length)
    for wrong in [(rows, length + 1), (rows + 1, length), (length + 1, rows, length + 2), (length,), ()]:
        with refused(CompilationError, name, found=wrong):
            checked(name, np.ones(wrong), SMALL)


def test_arrays_that_are_put_in_are_numbers_one_after_another():
    rows, length = shape("gain", SMALL)
    array = checked("gain", np.arange(rows * length).reshape(length, rows).T, SMALL)
    assert array.dtype == float
    assert array.flags.c_contiguous


def test_a_program_has_all_constants_and_refuses_one_of_another_shape():
    loop = Experiment(small_cell(), SMALL_GAINS, 0.05).closed_loop()
    assert set(_constants(loop, classify(loop))) == set(owned_by("cell"))
    loop.plant.viscous = loop.plant.viscous[:, :1]
    with refused(CompilationError, "viscous"):
        Program(loop)


def test_tables_of_another_shape_are_refused_by_name():
    program = Program(Experiment(small_cell(), SMALL_GAINS, 0.05).closed_loop())
    with refused(CompilationError, "desired_dot", found=(2, 3, 5)):
        program.tell(structs.Steps(), {"desired_dot": np.zeros((2, 3, 5))})
