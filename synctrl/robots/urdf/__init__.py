"""Documents of robots: read strictly, checked, written anew for Pinocchio."""

from .description import (
    Description,
    build_model,
    describe,
    existing_file,
    lock_joints,
    model_from_xml,
    read_urdf,
    urdf_folder,
)

__all__ = [
    "Description",
    "build_model",
    "describe",
    "existing_file",
    "lock_joints",
    "model_from_xml",
    "read_urdf",
    "urdf_folder",
]
