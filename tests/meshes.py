"""Small mesh files in every format, and scenes of them, for the tests."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import trimesh

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 3]])

ASSET = "<asset><created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified>{}</asset>"
COLLADA = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
{asset}{materials}
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="9">{corners}</float_array><technique_common>
<accessor source="#pa" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<source id="t"><float_array id="ta" count="6">0 0 1 0 0 1</float_array><technique_common>
<accessor source="#ta" count="3" stride="2"><param name="S" type="float"/><param name="T" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1" material="m"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#t" offset="0" set="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
{nodes}<library_visual_scenes><visual_scene id="s">{scene}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
SHAPE = '<node id="n"><instance_geometry url="#g"/></node>'
COLORED = """<node id="n"><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="m" target="#mm"><bind_vertex_input semantic="UV" input_semantic="TEXCOORD"
input_set="0"/></instance_material></technique_common></bind_material></instance_geometry></node>"""
MATERIALS = """<library_images><image id="i"><init_from>{0}</init_from></image></library_images>
<library_effects><effect id="e"><profile_COMMON>
<newparam sid="su"><surface type="2D"><init_from>i</init_from></surface></newparam>
<newparam sid="sa"><sampler2D><source>su</source></sampler2D></newparam>
<technique sid="c"><lambert><diffuse><texture texture="sa" texcoord="UV"/></diffuse></lambert></technique>
</profile_COMMON></effect></library_effects>
<library_materials><material id="mm"><instance_effect url="#e"/></material></library_materials>"""


def collada(
    unit: str = "", nodes: str = "", scene: str = "", texture: str = "", corners: np.ndarray = TRIANGLE
) -> bytes:
    """A COLLADA file with one triangle, `unit` in its asset, further nodes, its scene, and a texture."""
    words = " ".join(str(number) for number in np.ravel(corners))
    materials = MATERIALS.format(texture) if texture else ""
    parts = {"asset": ASSET.format(unit), "materials": materials, "corners": words, "nodes": nodes}
    return COLLADA.format(**parts, scene=scene or (COLORED if texture else SHAPE)).encode()


def stl(corners: np.ndarray = TRIANGLE) -> bytes:
    """A binary STL of triangles, (k, 3, 3) or (3, 3)."""
    triangles = np.reshape(corners, (-1, 3, 3))
    rows = b"".join(bytes(12) + triangle.astype("<f4").tobytes() + bytes(2) for triangle in triangles)
    return bytes(80) + len(triangles).to_bytes(4, "little") + rows


def text_stl(corners: np.ndarray = TRIANGLE) -> bytes:
    """A text STL of one triangle."""
    lines = "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners)
    return f"solid a\nfacet normal 0 0 0\nouter loop\n{lines}endloop\nendfacet\nendsolid a\n".encode()


def obj(corners: np.ndarray = TRIANGLE, library: str = "") -> bytes:
    """An OBJ of one triangle, with a material library."""
    lines = "".join(f"v {x} {y} {z}\n" for x, y, z in corners)
    use = f"mtllib {library}\nusemtl m\n" if library else ""
    return f"{use}{lines}vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n".encode()


def glb(corners: np.ndarray = TRIANGLE, **changes: object) -> bytes:
    """A GLB of one triangle; `changes` replace what its header says."""
    numbers = np.asarray(corners, "<f4").tobytes()
    header = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 12},
        ],
        "buffers": [{"byteLength": 48}],
    }
    text = json.dumps(header | changes).encode()
    text += b" " * (-len(text) % 4)
    binary = numbers + np.arange(3, dtype="<u4").tobytes()
    chunks = (
        struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(binary)) + b"BIN\0" + binary
    )
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def ball(file: Path) -> trimesh.Trimesh:
    """A ball with a dent, written to a file by trimesh in the format of its name."""
    solid = trimesh.creation.icosphere(subdivisions=2, radius=0.2)
    solid.vertices[solid.vertices[:, 0] > 0.1] *= 0.7
    solid.export(file)
    return solid


WRITTEN = {"a.stl": stl, "text.stl": text_stl, "a.dae": collada, "a.obj": obj, "a.glb": glb}
"""What writes one triangle, or other corners, by a file name."""


def written(name: str, corners: np.ndarray = TRIANGLE) -> bytes:
    """A file of this name with these corners, (3, 3)."""
    return collada(corners=corners) if name.endswith(".dae") else WRITTEN[name](corners)
