"""Pinocchio alone on a URDF file, as the judge of what this package makes of it."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pinocchio as pin

from synctrl.robots.urdf import Description

_HELD = re.compile(r"held at (\S+)")


def read_by_pinocchio(file: Path) -> tuple[pin.Model | None, str]:
    """Pinocchio's own model, None if it refuses the file, and what it complains of."""
    saved = os.dup(2)
    with tempfile.TemporaryFile() as written:
        os.dup2(written.fileno(), 2)
        try:
            model = pin.buildModelFromUrdf(str(file))
        except ValueError:
            model = None
        finally:
            os.dup2(saved, 2)
            os.close(saved)
        written.seek(0)
        return model, written.read().decode(errors="replace")


def positions_held(description: Description) -> dict[str, float]:
    """By joint, where it is held, as the report says."""
    notes = description.report.of_kind("locked")
    names = [re.fullmatch(r"joint '(.*)'", note.where) for note in notes]
    return {name[1]: float(_HELD.match(note.text)[1]) for name, note in zip(names, notes, strict=True)}


def with_joints_held(model: pin.Model, positions: Mapping[str, float]) -> pin.Model:
    """The model reduced to the joints that are not held."""
    q = pin.neutral(model)
    for name, position in positions.items():
        at = model.joints[model.getJointId(name)]
        q[at.idx_q : at.idx_q + at.nq] = position if at.nq == 1 else (np.cos(position), np.sin(position))
    return pin.buildReducedModel(model, [model.getJointId(name) for name in positions], q)


def same_dynamics(mine: pin.Model, theirs: pin.Model, rtol: float) -> None:
    """Inverse dynamics of both agree at random states, joint by joint of the same names."""
    assert list(mine.names)[1:] == list(theirs.names)[1:]
    for q, v, a in np.random.default_rng(2).uniform(-1, 1, (3, 3, mine.nv)):
        mine_tau, tau = (
            pin.rnea(model, model.createData(), pin.integrate(model, pin.neutral(model), q), v, a)
            for model in (mine, theirs)
        )
        np.testing.assert_allclose(mine_tau, tau, rtol=0, atol=rtol * (abs(tau).max() + 1e-12))
