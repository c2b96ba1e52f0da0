"""What the machine's processor can do: generated code is made for it, and runs on no other one."""

from __future__ import annotations

import platform
import subprocess
import sys
from collections.abc import Collection
from functools import cache
from pathlib import Path

#: features, and how many doubles fit the vectors that come with them; the widest first
WIDTHS = {"avx512f": 8, "avx2": 4, "sse2": 2, "asimd": 2}
#: what every processor of a kind has
_ALWAYS = {"x86_64": "sse2", "amd64": "sse2", "arm64": "asimd", "aarch64": "asimd"}
#: how Linux begins the line of a processor's features, on x86 and on ARM
_LINES = ("flags", "Features")
_SYSCTL = ("/usr/sbin/sysctl", "hw.optional", "machdep.cpu")


@cache
def cpu_features() -> tuple[str, ...]:
    """Names of what the processor can do, sorted; its name, where the system says no more."""
    found = of_macos(_sysctl()) if sys.platform == "darwin" else of_linux(_cpuinfo())
    always = _ALWAYS.get(platform.machine().lower(), platform.machine())
    return tuple(sorted({*(found or {platform.processor()}), always}))


def widest(features: Collection[str] | None = None) -> int:
    """How many doubles fit the widest vectors of this processor, or of one with these features."""
    found = cpu_features() if features is None else features
    return next((width for name, width in WIDTHS.items() if name in found), 1)


def of_linux(cpuinfo: str) -> set[str]:
    """The features that all processors share, of the text of /proc/cpuinfo."""
    lines = (line.partition(":") for line in cpuinfo.splitlines())
    found = [set(words.split()) for name, _, words in lines if name.strip() in _LINES]
    return set.intersection(*found) if found else set()


def of_macos(said: str) -> set[str]:
    """The features in what sysctl prints; an Intel processor has lists of them, others have one line each."""
    found = set()
    for line in said.splitlines():
        name, _, value = line.partition(":")
        if name.startswith("hw.optional.") and value.strip() == "1":
            found.add(name.rpartition(".")[2].lower())
        elif name.startswith("machdep.cpu.") and name.endswith("features"):
            found |= set(value.lower().split())
    return found


# -- internals --------------------------------------------------------------------------------------------


def _cpuinfo() -> str:
    try:
        return Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _sysctl() -> str:
    try:
        done = subprocess.run(_SYSCTL, capture_output=True, stdin=subprocess.DEVNULL, timeout=10)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.decode(errors="replace")
