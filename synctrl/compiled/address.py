"""Addresses of arrays, as `ctypes` hands them to C."""

from __future__ import annotations

import ctypes


class Address(ctypes.c_void_p):
    """An address, and how C declares what has it."""

    written: str


def _address(written: str) -> type[Address]:
    return type("Address", (Address,), {"written": written})


Doubles, Ints, Chars = map(_address, ("double *", "int *", "char *"))
Anything = _address("void *")
#: numbers of all lanes
Vectors = _address("vec *")
#: a function in Python that the driver calls: time, the middle of the step, whether a sample falls on it -> 0
Callback = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, ctypes.c_double, ctypes.c_int)
Callbacks, CALLBACK = _address("Callback *"), "typedef int Callback(double, double, int);\n"
