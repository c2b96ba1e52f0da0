"""Let me see: figures, animations, pages."""

from .assembly_figures import internal_forces
from .cell_scene import scene_of
from .consistency_plots import consistency
from .look import save
from .lyapunov_plots import lyapunov_terms
from .network_figures import traffic
from .overlays import overlays
from .phase_figures import phase_portraits
from .plots import sync_errors, tracking_errors
from .run_figures import estimates, gallery, paths, torques
from .run_page import write_run_page
from .side_by_side import side_by_side
from .spectrum_figures import spectra
from .tip_figures import tip_paths

__all__ = [
    "consistency",
    "estimates",
    "gallery",
    "internal_forces",
    "lyapunov_terms",
    "overlays",
    "paths",
    "phase_portraits",
    "save",
    "scene_of",
    "side_by_side",
    "spectra",
    "sync_errors",
    "tip_paths",
    "torques",
    "tracking_errors",
    "traffic",
    "write_run_page",
]
