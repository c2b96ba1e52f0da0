"""The structures of driver.c, field by field."""

from __future__ import annotations

import ctypes


class CellStruct(ctypes.Structure):
    """`Cell` of driver.c."""

    _fields_ = [
        *((name, ctypes.c_int) for name in ("n", "m", "nv", "P", "Z", "p", "bodies")),
        *(
            (name, ctypes.c_void_p)
            for name in (
                "kind", "edge", "sign", "first", "incident", "incident_sign", "Lambda", "beta", "K_eps",
                "K_r", "Gamma", "W_inv", "posture", "gain", "base", "pi", "viscous", "coulomb", "smoothing",
                "limits",
            )
        ),
        ("rubs", ctypes.c_int),
        ("saturates", ctypes.c_int),
        ("K", ctypes.c_int),
        ("arity", ctypes.c_int),
        ("max_condition", ctypes.c_double),
        ("max_angle", ctypes.c_double),
    ]  # fmt: skip


class ReferenceStruct(ctypes.Structure):
    """`Reference` of driver.c."""

    _fields_ = [
        ("desired", ctypes.c_void_p),
        ("weights", ctypes.c_void_p),
        ("steps", ctypes.c_int),
        ("constant", ctypes.c_int),
        ("first", ctypes.c_int),
        ("count", ctypes.c_int),
    ]


class LogStruct(ctypes.Structure):
    """`Log` of driver.c, in the order of `LAYOUT` without t, and the adaptation's state if it is logged."""

    _fields_ = [
        (name, ctypes.c_void_p)
        for name in (
            "x", "x_desired", "tracking_error", "sync_error", "sync_integral", "coupled_error",
            "q", "v", "v_error", "tau", "disturbance", "theta_hat", "z",
        )
    ]  # fmt: skip


class WorkStruct(ctypes.Structure):
    """`Work` of driver.c."""

    _fields_ = [
        *(
            (name, ctypes.c_void_p)
            for name in ("w", "iw", "arg", "res", "task", "trig", "J", "compared", "shares", "tau", "loaded")
        ),
        ("e_star", ctypes.c_void_p),
        ("s_q", ctypes.c_void_p),
        ("pi", ctypes.c_void_p),
        ("k", ctypes.c_void_p * 4),
        *((name, ctypes.c_void_p) for name in ("stage", "sign", "held", "held_tau", "step_error")),
    ]


class StepErrorStruct(ctypes.Structure):
    """`StepError` of driver.c."""

    _fields_ = [
        *((name, ctypes.c_double) for name in ("largest", "speed", "time", "h", "h_before")),
        ("v", ctypes.c_void_p),
        ("a", ctypes.c_void_p),
        ("at", ctypes.c_int),
    ]


class ReportStruct(ctypes.Structure):
    """`Report` of driver.c."""

    _fields_ = [
        ("status", ctypes.c_int),
        ("step", ctypes.c_int),
        ("robot", ctypes.c_int),
        ("value", ctypes.c_double),
        ("rows", ctypes.c_long),
    ]
