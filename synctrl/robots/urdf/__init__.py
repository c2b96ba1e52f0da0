"""Documents of robots: read strictly, checked, written anew for Pinocchio."""

from .build import build_model, model_from_xml
from .changes import lock_joints
from .description import Description, describe, existing_file, read_urdf, urdf_folder

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
