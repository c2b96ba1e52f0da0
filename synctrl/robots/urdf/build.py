"""Pinocchio's model of a checked document, and that it is what the document says."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ...errors import RobotError
from .checks import ROUNDING, body_parameters, some
from .document import Document
from .writer import dynamics_xml

WORST_CONDITION = 1e13
"""Of the mass matrix: beyond it accelerations have no correct digits left that matter."""


def build_model(document: Document) -> pin.Model:
    """Pinocchio's model of a checked document, with its names.

    Pinocchio knows links and joints by name as frames, and calls the world "universe". Where a joint shares
    its name with one of these, its frame is called otherwise; the joint itself bears its name.

    Raises:
        RobotError: Pinocchio refuses it all the same.
    """
    taken = {"universe", *(link.name for link in document.links)}
    joints = {joint.name: _other(joint.name, taken) for joint in document.joints if joint.name in taken}
    model = model_from_xml(document.source, dynamics_xml(document.renamed(joints)))
    named = {name: joint for joint, name in joints.items()}
    for k, name in enumerate(list(model.names)):
        model.names[k] = named.get(name, name)
    rotors = {joint.name: joint.armature for joint in document.moving_joints}
    model.armature = np.array([rotors[name] for name in list(model.names)[1:]])
    return model


def _other(name: str, taken: set[str]) -> str:
    """A name that nothing has."""
    return next(other for k in range(2, len(taken) + 3) if (other := f"{name} ({k})") not in taken)


def model_from_xml(source: str, xml: str) -> pin.Model:
    """Pinocchio's model of a URDF text; `source` is what messages call it."""
    try:
        return pin.buildModelFromXML(xml)
    except Exception as error:
        reason = f"expected a URDF that Pinocchio accepts, found: {error}"
        raise RobotError(reason, file=source, found=str(error)) from error


def check_model(document: Document, model: pin.Model) -> None:
    """Refuse a model that is not what the document says, or whose dynamics are not those of a mechanism.

    Raises:
        RobotError: joints or inertial parameters differ, or H(q) is not positive definite.
    """
    joints = sorted(joint.name for joint in document.moving_joints)
    if sorted(list(model.names)[1:]) != joints:
        found = some(list(model.names)[1:])
        raise document.error(f"expected a model with the joints {some(joints)}, found {found}", found=found)
    _check_inertias(document, model)
    for q in _configurations(model):
        _check_mass_matrix(document, model, q)


def _check_inertias(document: Document, model: pin.Model) -> None:
    expected, joints = body_parameters(document), {joint.name: joint for joint in document.moving_joints}
    for name, inertia in list(zip(model.names, model.inertias, strict=True))[1:]:
        wanted, found = expected[name], inertia.toDynamicParameters()
        if abs(found - wanted).max() > ROUNDING * abs(wanted).max():
            raise document.error(
                f"expected a model with the inertial parameters of the document, {wanted}, found {found}",
                joints[name],
                found=found,
            )


def _configurations(model: pin.Model) -> list[np.ndarray]:
    """The neutral configuration and three others, the same in every run."""
    rng = np.random.default_rng(0)
    neutral = pin.neutral(model)
    return [neutral, *(pin.integrate(model, neutral, rng.uniform(-1, 1, model.nv)) for _ in range(3))]


def _check_mass_matrix(document: Document, model: pin.Model, q: np.ndarray) -> None:
    data = model.createData()
    H = pin.crba(model, data, q)
    gravity = pin.computeGeneralizedGravity(model, data, q)
    expected = "expected a positive definite mass matrix and finite gravity"
    if not (np.isfinite(H).all() and np.isfinite(gravity).all()):
        raise document.error(f"{expected}, found numbers that are not finite")
    # scaled to ones on the diagonal, so that units and sizes of joints do not matter
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    lowest, highest = np.linalg.eigvalsh(H / np.outer(scale, scale))[[0, -1]]
    if lowest <= 0 or highest / lowest > WORST_CONDITION:
        raise document.error(f"{expected}, found eigenvalues from {lowest:g} to {highest:g} after scaling")
