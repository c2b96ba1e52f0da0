"""Tune: values of factors, such as gains, with which runs are as good as they can be."""

from .goals import Goal
from .search import tune
from .tuned import Tuned

__all__ = ["Goal", "Tuned", "tune"]
