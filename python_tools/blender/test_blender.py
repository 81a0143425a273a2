"""Blender opens a tree, and what it renders shows one: run by ``make test-full`` in an environment of its own.

The tree is that of SPHEREBOARD_GLB; the picture is kept where SPHEREBOARD_PICTURE says, for people to look at.
"""

import os
from pathlib import Path

import bpy
import numpy as np
import pytest

SIDE_PX = 256


@pytest.fixture(scope="module")
def scene() -> bpy.types.Scene:
    """Import the tree of SPHEREBOARD_GLB into an empty scene, lit and seen from the front."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=os.environ["SPHEREBOARD_GLB"])
    scene = bpy.context.scene
    height = max(corner[2] for mesh in meshes() for corner in world_corners(mesh))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 1.2 * max(height, *(abs(c[0]) * 2 for mesh in meshes() for c in world_corners(mesh)))
    # glTF's +Z, the front, is Blender's −Y.
    camera.location, camera.rotation_euler = (0, -10 * height, height / 2), (np.pi / 2, 0, 0)
    camera.data.clip_end = 100 * height
    scene.collection.objects.link(camera)
    scene.camera = camera
    world = bpy.data.worlds.new("sky")
    if not world.use_nodes:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
    scene.world = world
    return scene


def meshes() -> list[bpy.types.Object]:
    """List the imported meshes."""
    return [thing for thing in bpy.data.objects if thing.type == "MESH"]


def world_corners(thing: bpy.types.Object) -> list[tuple[float, float, float]]:
    """List the corners of a mesh's box, in the scene."""
    from mathutils import Vector

    return [tuple(thing.matrix_world @ Vector(corner)) for corner in thing.bound_box]


def test_the_tree_stands_upright_on_the_ground(scene: bpy.types.Scene):
    heights = [corner[2] for mesh in meshes() for corner in world_corners(mesh)]
    assert min(heights) == pytest.approx(0, abs=0.05 * max(heights))
    assert max(heights) > 0.5


def test_the_crown_keeps_its_material(scene: bpy.types.Scene):
    foliage = ("crown", "leaves")
    crowns = [mesh for mesh in meshes() if any(word in (mesh.name + mesh.data.name).lower() for word in foliage)]
    assert crowns, f"no foliage among {[mesh.name for mesh in meshes()]}"
    for crown in crowns:
        nodes = [node for slot in crown.material_slots for node in slot.material.node_tree.nodes]
        images = [node.image for node in nodes if node.type == "TEX_IMAGE" and node.image]
        assert images and all(min(image.size) > 0 for image in images)
        assert crown.data.uv_layers


def test_the_render_shows_a_tree(scene: bpy.types.Scene, tmp_path: Path):
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 8
    scene.cycles.device = "CPU"
    scene.render.resolution_x = scene.render.resolution_y = SIDE_PX
    scene.render.film_transparent = True
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.filepath = os.environ.get("SPHEREBOARD_PICTURE", str(tmp_path / "render.png"))
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(image.pixels[:]).reshape(SIDE_PX, SIDE_PX, 4)
    covered = pixels[..., 3] > 0.5
    assert 0.02 < covered.mean() < 0.98
    # Cards with their cut-outs lost would cover the frame's middle without a hole.
    middle = covered[SIDE_PX // 4 : 3 * SIDE_PX // 4, SIDE_PX // 8 : 7 * SIDE_PX // 8]
    assert not middle.all()
    assert pixels[covered][:, :3].std() > 0.01, "one flat colour: the texture is lost"
