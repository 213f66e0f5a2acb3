"""Animated scenes in glTF: closed surfaces, keyframes that are the motion, documents that the Khronos validator accepts."""

import json
import shutil
import struct
import subprocess

import numpy as np
import pytest

import flyball as fb
from flyball.view.gltf import shape_surface
from flyball.view.recording import Shape

R, H = 0.3, 0.8
PI = np.pi
VOLUMES = {
    "box": (Shape("box", (1.0, 2.0, 3.0)), 6.0),
    "plate": (Shape("plate", (0.5,), outline=((0, 0), (2, 0), (2, 1), (1, 0.2), (0, 1))), 0.5 * (2 - 0.8)),
    "plate, clockwise": (Shape("plate", (0.5,), outline=((0, 1), (2, 1), (2, 0), (0, 0))), 1.0),
    "sphere": (Shape("sphere", (R,)), 4 / 3 * PI * R**3),
    "ellipsoid": (Shape("ellipsoid", (1.0, 0.5, 0.25)), 4 / 3 * PI * 0.125),
    "cylinder": (Shape("cylinder", (R, H)), PI * R**2 * H),
    "capsule": (Shape("capsule", (R, H)), PI * R**2 * H + 4 / 3 * PI * R**3),
    "cone": (Shape("cone", (R, H)), PI * R**2 * H / 3),
}


@pytest.mark.parametrize("name", VOLUMES)
def test_surfaces_are_closed_and_face_outwards(name):
    shape, volume = VOLUMES[name]
    v, t, n = shape_surface(shape)
    a, b, c = (v[t[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    assert np.abs(flat.sum(axis=0)).max() < 1e-12 * np.abs(flat).sum()  # closed
    assert np.einsum("ij,ij->", a, flat) / 6 == pytest.approx(volume, rel=0.02)
    if n is not None:
        assert np.linalg.norm(n, axis=1) == pytest.approx(1.0)
        assert all((np.einsum("ij,ij->i", n[t[:, k]], flat) > 0).all() for k in range(3))


def document(path) -> tuple[dict, bytes]:
    data = path.read_bytes()
    magic, version, length = struct.unpack("<4sII", data[:12])
    assert (magic, version, length) == (b"glTF", 2, len(data))
    n = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + n]), data[28 + n :]


def numbers(doc: dict, blob: bytes, k: int) -> np.ndarray:
    x = doc["accessors"][k]
    view = doc["bufferViews"][x["bufferView"]]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[x["type"]]
    kind = np.uint32 if x["componentType"] == 5125 else np.float32
    return np.frombuffer(blob, kind, x["count"] * width, view["byteOffset"]).reshape(x["count"], width)


@pytest.mark.parametrize("name", ["slider_crank", "governor", "rope_pendulum"])
def test_keyframes_are_the_motion(name, tmp_path):
    run = fb.load(f"examples/{name}.toml").simulate(0.3, outputs=31)
    run.save(tmp_path / "run.glb")
    doc, blob = document(tmp_path / "run.glb")
    node = {n["name"]: k for k, n in enumerate(doc["nodes"])}
    animation = doc["animations"][0]
    moving = {
        (c["target"]["node"], c["target"]["path"]): animation["samplers"][c["sampler"]] for c in animation["channels"]
    }
    compared = 0
    for body in run.model.bodies:
        if (sampler := moving.get((node.get(body.name), "translation"))) is None:
            continue
        t, p = numbers(doc, blob, sampler["input"])[:, 0], numbers(doc, blob, sampler["output"])
        for time, place in zip(t[::5], p[::5], strict=True):
            k = int(np.argmin(np.abs(run.t - run.t[0] - time)))
            if abs(run.t[k] - time) < 1e-6:
                assert np.allclose(place[: run[body.name].position.shape[1]], run[body.name].position[k], atol=1e-6)
                compared += 1
    assert compared > 3
    assert ("rotation" in doc["nodes"][0]) == (not run.model.planar)


def test_a_motionless_scene_and_unknown_endings(tmp_path):
    m = fb.Mechanism("block")
    m.add(fb.Body("block", shape=fb.Box(edges=(1, 1, 1)), density=1, color="red"))
    m.simulate(0.1, outputs=3).save(tmp_path / "still.glb")
    doc, _ = document(tmp_path / "still.glb")
    assert "animations" not in doc
    assert doc["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx([1, 0, 0], abs=1e-3)
    with pytest.raises(fb.ModelError, match=r"'\.gltf' is not known here; it must be \.nc .*\.glb"):
        m.simulate(0.1, outputs=3).save(tmp_path / "still.gltf")


def test_the_khronos_validator_finds_no_fault(tmp_path):
    node = shutil.which("node")
    script = (
        "const v=require('gltf-validator');v.validateBytes(new Uint8Array(require('fs').readFileSync(process.argv[1])))"
        ".then(r=>console.log(r.issues.numErrors+r.issues.numWarnings))"
    )
    if node is None or subprocess.run([node, "-e", "require('gltf-validator')"], capture_output=True).returncode:
        pytest.skip("needs Node.js and its package gltf-validator (NODE_PATH)")
    for name in ("governor.toml", "double_wishbone.toml", "cam_follower.toml"):
        fb.load(f"examples/{name}").simulate(0.05, outputs=11).save(tmp_path / "run.glb")
        found = subprocess.run(
            [node, "-e", script, str(tmp_path / "run.glb")], capture_output=True, text=True, check=True
        )
        assert found.stdout.strip() == "0"
