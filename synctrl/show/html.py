"""MeshCat commands -> one HTML file that plays them offline, with no server behind it."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from collections.abc import Iterable, Sequence
from html import escape
from importlib.util import find_spec
from pathlib import Path

from ..errors import MissingDependencyError

STYLE = """
body { margin: 0; overflow: hidden; font-family: system-ui, sans-serif; }
#meshcat-pane { width: 100vw; height: 100vh; overflow: hidden; }
#words { position: absolute; left: 14px; top: 12px; max-width: min(60vw, 44em); pointer-events: none;
         color: #1d2733; text-shadow: 0 0 4px #fff, 0 0 4px #fff; }
#words h1 { margin: 0 0 4px; font-size: 17px; font-weight: 600; }
#words p { margin: 0 0 3px; font-size: 13px; line-height: 1.35; }
#words i { display: inline-block; width: 10px; height: 10px; margin: 0 5px 0 0; border-radius: 2px; }
#words span { display: inline-block; margin-right: 14px; }
#failure { color: #a40000; font-weight: 600; }
"""

PLAYER = """
"use strict";
var viewer;

async function inflate(line) {
  const packed = Uint8Array.from(atob(line), c => c.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(plain).arrayBuffer());
}

function shade(root) {
  root.traverse(object => {
    if (object.isMesh && !object.geometry.attributes.normal) object.geometry.computeVertexNormals();
  });
}

function arrangeControls() {
  const scene = viewer.scene_tree.find(["meshcat"]);
  const root = scene.find(["<object>"]).object;
  root.children.forEach(child => scene.add_child(child));
  viewer.gui.__folders["Scene"].close();
  viewer.gui.open();
}

function showTime() {
  document.getElementById("time").textContent = `t = ${viewer.animator.time.toFixed(2)} s`;
  requestAnimationFrame(showTime);
}

async function start() {
  const lines = document.getElementById("commands").textContent.trim().split("\\n");
  const commands = await Promise.all(lines.map(inflate));
  const pane = document.getElementById("meshcat-pane");
  viewer = new MeshCat.Viewer(pane);
  viewer.controls.target.fromArray(JSON.parse(pane.dataset.target));
  commands.forEach(command => viewer.handle_command_bytearray(command));
  shade(viewer.scene);
  arrangeControls();
  if (viewer.animator.duration > 0) showTime();
}

start().catch(error => {
  document.getElementById("failure").textContent = `This scene cannot be shown: ${error.message}`;
  throw error;
});
"""


def page(
    commands: Iterable[bytes],
    target: Sequence[float],
    title: str,
    caption: str,
    legend: Sequence[tuple[str, str]] = (),
    remarks: Sequence[str] = (),
) -> str:
    """A self-contained HTML page that shows a scene and asks nothing of the network.

    Args:
        commands: packed MeshCat commands, in order.
        target: what the camera aims at and turns about, in the viewer's axes.
        title: heading; text, never markup.
        caption: line below it; text, never markup.
        legend: label and colour (#rrggbb) pairs.
        remarks: lines below the legend; text, never markup.

    Raises:
        MissingDependencyError: MeshCat's viewer is not installed.
    """
    lines = "\n".join(base64.b64encode(gzip.compress(c, mtime=0)).decode() for c in commands)
    library = _viewer_source("dist/main.min.js")
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{_policy([library, PLAYER])}">',
            '<meta name="viewport" content="width=device-width"><link rel="icon" href="data:,">',
            f"<title>{escape(title) or 'Scene'}</title><style>{STYLE}</style></head><body>",
            f'<div><div id="meshcat-pane" data-target="{json.dumps(list(target))}"></div></div>',
            f'<div id="words">{_words(title, caption, legend, remarks)}</div>',
            f'<script type="text/plain" id="licences">{_licences()}</script>',
            f'<script type="text/plain" id="commands">{lines}</script>',
            f"<script>{library}</script><script>{PLAYER}</script></body></html>\n",
        ]
    )


def frame(page: str, height: int) -> str:
    """A page inside another one, as an `<iframe>` with its own, closed world."""
    style = f"width: 100%; height: {height}px; border: 0"
    return (
        f'<iframe sandbox="allow-scripts allow-downloads" style="{style}" srcdoc="{escape(page)}"></iframe>'
    )


def _words(title: str, caption: str, legend: Sequence[tuple[str, str]], remarks: Sequence[str]) -> str:
    entries = [f'<span><i style="background: {escape(c)}"></i>{escape(label)}</span>' for label, c in legend]
    paragraphs = [escape(caption), "".join(entries), *map(escape, remarks)]
    heading = f"<h1>{escape(title)}</h1>" if title else ""
    text = "".join(f"<p>{p}</p>" for p in paragraphs if p)
    return f'{heading}{text}<p id="time"></p><p id="failure"></p>'


def _policy(scripts: Iterable[str]) -> str:
    """Content security policy: these scripts and nothing else, and no requests."""
    hashes = (base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts)
    allowed = " ".join(f"'sha256-{h}'" for h in hashes)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        "img-src data: blob:; worker-src blob:; base-uri 'none'; form-action 'none'"
    )


def _licences() -> str:
    return "\n".join(_viewer_source(name) for name in ("LICENSE", "dist/main.min.js.LICENSE.txt"))


def _viewer_source(name: str) -> str:
    """A file of MeshCat's viewer as text for a script element; the Python package is not imported."""
    spec = find_spec("meshcat")
    path = Path(spec.submodule_search_locations[0], "viewer", name) if spec else Path(name)  # type: ignore
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise MissingDependencyError(
            f"MeshCat's viewer is not where it is expected ({path.name} is missing); "
            "install meshcat 0.3.2 or later"
        ) from error
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")
