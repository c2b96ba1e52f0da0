"""From generated C to a loaded library, kept in a cache.

The cache is addressed by content: the key is a digest of everything the code depends on, so a second run
compiles nothing, and an entry is never wrong, only missing. An entry that is damaged is built again. Entries
appear under their name only once complete, so two processes may build the same one at the same time.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ...errors import CompilationError, MissingDependencyError

#: -O1, because generated code is one long sum of products: -O2 makes it no faster, only longer to compile
FLAGS = ("-O1", "-fPIC", "-fno-math-errno", "-ffp-contract=off")


def require_casadi() -> str:
    """Version of CasADi.

    Raises:
        MissingDependencyError: it is not installed.
    """
    try:
        from casadi import CasadiMeta
    except ImportError as error:
        raise MissingDependencyError(
            "engine='compiled' needs CasADi: pip install 'synctrl[compiled]'; or use engine='pinocchio'"
        ) from error
    return str(CasadiMeta.version())


def compiler() -> list[str]:
    """The machine's C compiler: the environment variable CC, or cc, gcc or clang.

    Raises:
        MissingDependencyError: there is none.
    """
    wanted = shlex.split(os.environ.get("CC", ""))
    for command in [wanted] if wanted else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(command[0]):
            return command
    named = f" named by CC, '{wanted[0]}'" if wanted else ""
    raise MissingDependencyError(
        f"engine='compiled' needs a C compiler, and the one{named} was not found; "
        "install one (gcc or clang), or use engine='pinocchio'"
        if named
        else "engine='compiled' needs a C compiler (cc, gcc or clang), and none was found; "
        "install one, or use engine='pinocchio'"
    )


def cache_folder() -> Path:
    """Where compiled libraries are kept: SYNCTRL_CACHE, or the user's cache folder."""
    chosen = os.environ.get("SYNCTRL_CACHE")
    if chosen:
        return Path(chosen)
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "synctrl"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "synctrl"


def content_key(*parts: object) -> str:
    """Digest of plain data, of the generating code, and of the compiler."""
    command = compiler()
    version = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False).stdout
    sources = [path.read_text(encoding="utf-8") for path in _generating_code()]
    content = json.dumps([*parts, command, version, FLAGS, sources], sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()


def cached_library(
    key: str, generate: Callable[[], Iterable[str]], check: Callable[[ctypes.CDLL], None]
) -> ctypes.CDLL:
    """The library of a key, from the cache or built now.

    Args:
        key: see `content_key`.
        generate: writes the C sources, called only if they are needed; they are compiled as they come.
        check: raises if a newly built library computes something else than it should.

    Raises:
        CompilationError: the compiler refused the code, or the cache cannot be written.
    """
    library = cache_folder() / f"{key}.so"
    loaded = _load(library)
    if loaded is None:
        try:
            library.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=library.parent, prefix="building-") as folder:
                built = _compile(generate(), Path(folder))
                check(ctypes.CDLL(str(built)))
                _publish(built, library)
        except OSError as error:
            raise CompilationError(f"cannot write to the cache '{library.parent}': {error}") from error
        loaded = _load(library)
    if loaded is None:
        raise CompilationError(f"'{library}' was built but cannot be loaded")
    return loaded


def _load(library: Path) -> ctypes.CDLL | None:
    """The library if its content is what was once published, else None."""
    try:
        digest = library.with_suffix(".sha256").read_text(encoding="ascii").strip()
        if hashlib.sha256(library.read_bytes()).hexdigest() != digest:
            return None
        return ctypes.CDLL(str(library))
    except (OSError, UnicodeDecodeError):
        return None


def _publish(built: Path, library: Path) -> None:
    """Move a library and its digest to their names. In between, a reader sees a digest that does not fit."""
    digest = built.with_suffix(".sha256")
    digest.write_text(hashlib.sha256(built.read_bytes()).hexdigest(), encoding="ascii")
    built.replace(library)
    digest.replace(library.with_suffix(".sha256"))


def _compile(sources: Iterable[str], folder: Path) -> Path:
    """Compile each source as soon as it is there, as many at a time as there are cores, and link them."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = [pool.submit(_compile_one, source, folder / f"part{k}.c") for k, source in enumerate(sources)]
    library = folder / "library.so"
    _run([*compiler(), "-shared", *(str(job.result()) for job in jobs), "-o", str(library), "-lm"])
    return library


def _compile_one(source: str, path: Path) -> Path:
    path.write_text(source, encoding="utf-8")
    _run([*compiler(), *FLAGS, "-c", str(path), "-o", str(path.with_suffix(".o"))])
    return path.with_suffix(".o")


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise CompilationError(f"the C compiler refused generated code:\n{done.stderr.strip()[:2000]}")


def _generating_code() -> list[Path]:
    package = Path(__file__).parents[2]
    here = Path(__file__).parent
    return [
        package / "control" / "law.py",
        package / "robots" / "symbolic.py",
        *(here / name for name in ("kind.py", "trace.py", "pose.py", "program.py", "driver.c")),
    ]
