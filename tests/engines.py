"""The engine of long runs that ask nothing of an engine: other tests hold that both make the same."""

from __future__ import annotations

import importlib.util

ENGINE = "compiled" if importlib.util.find_spec("casadi") else "pinocchio"
