"""Cells from files: an experiment as TOML, read, written, and described by a schema."""

from .problems import CellFileError
from .reading import CellFile, read_cell, read_cell_file
from .schema import schema
from .starter import STARTER
from .writing import write_cell

__all__ = ["STARTER", "CellFile", "CellFileError", "read_cell", "read_cell_file", "schema", "write_cell"]
