"""Blender draws baked trees as it imports them: ``python draw_shots.py SHOTS.json``, where ``bake-methods`` wrote that list.

Each file's NAME.blender.png comes to stand beside it: what is covered, from the front, over nothing.
"""

import json
import math
import sys
from pathlib import Path
from typing import Any

import bpy

SAMPLES = 4


def draw(shot: dict[str, Any], folder: Path) -> None:
    """Import one file into an empty scene and render it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(folder / f"{shot['name']}.glb"))
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.sensor_fit, camera.data.angle = "VERTICAL", math.radians(shot["fov_deg"])
    camera.data.clip_end = 100 * shot["distance_m"]
    # glTF's +Z, the front, is Blender's −Y; its +Y is up here as Z.
    x, y, z = shot["target"]
    camera.location, camera.rotation_euler = (x, -z - shot["distance_m"], y), (math.pi / 2, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("sky")
    if not scene.world.use_nodes:
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", SAMPLES
    # Leaves behind leaves are looked through as often as need be.
    scene.cycles.transparent_max_bounces = 256
    scene.render.resolution_x, scene.render.resolution_y = shot["size_px"]
    scene.render.film_transparent = True
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.filepath = str(folder / f"{shot['name']}.blender.png")
    bpy.ops.render.render(write_still=True)


def main() -> int:
    """Draw all shots."""
    path = Path(sys.argv[1]).resolve()
    shots = json.loads(path.read_text(encoding="utf-8"))["shots"]
    for shot in shots:
        draw(shot, path.parent)
    print(f"{len(shots)} baked files drawn by Blender {bpy.app.version_string}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
