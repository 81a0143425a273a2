"""A small reader of GLB files: names, positions and triangles of their meshes."""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sphereboard_tools.images import BadInputError

TRIANGLES = 4
POSITION_TYPE = 5126
INDEX_TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32}


@dataclass(frozen=True)
class Surface:
    """One mesh of a file: positions (n, 3) in metres and triangles (m, 3) of indices into them."""

    name: str
    positions: NDArray[np.float32]
    triangles: NDArray[np.int64]

    def welded(self) -> "Surface":
        """Join vertices at equal positions: a texture's cut doubles them, but the surface has no cut there."""
        positions, index = np.unique(self.positions, axis=0, return_inverse=True)
        return Surface(self.name, positions, index.reshape(-1)[self.triangles])


def read_glb(path: Path) -> list[Surface]:
    """Read the meshes of a GLB file, the primitives of each joined."""
    document, binary = read_chunks(path)
    try:
        return [read_mesh(mesh, document, binary) for mesh in document.get("meshes", [])]
    except (KeyError, IndexError, ValueError) as error:
        raise BadInputError(f"{path} is not a GLB file of triangle meshes: {error!r}") from error


def read_chunks(path: Path) -> tuple[dict[str, Any], bytes]:
    """Split a GLB file into its JSON document and its binary chunk."""
    data = path.read_bytes()
    if data[:4] != b"glTF" or len(data) < 20:
        raise BadInputError(f"{path} is not a GLB file; give one that sphereboard model wrote")
    chunks: dict[bytes, bytes] = {}
    offset = 12
    while offset + 8 <= len(data):
        length, kind = struct.unpack_from("<I4s", data, offset)
        chunks[kind] = data[offset + 8 : offset + 8 + length]
        offset += 8 + length
    return json.loads(chunks.get(b"JSON", b"{}")), chunks.get(b"BIN\0", b"")


def read_mesh(mesh: dict[str, Any], document: dict[str, Any], binary: bytes) -> Surface:
    """Read one mesh."""
    positions: list[NDArray[np.float32]] = []
    triangles: list[NDArray[np.int64]] = []
    for primitive in mesh["primitives"]:
        if primitive.get("mode", TRIANGLES) != TRIANGLES:
            raise ValueError("a primitive that is not triangles")
        start = sum(map(len, positions))
        positions.append(read_accessor(document, binary, primitive["attributes"]["POSITION"], 3))
        if "indices" in primitive:
            index = read_accessor(document, binary, primitive["indices"], 1).astype(np.int64)
        else:
            index = np.arange(len(positions[-1]))
        triangles.append(index.reshape(-1, 3) + start)
    return Surface(mesh.get("name", ""), np.concatenate(positions), np.concatenate(triangles))


def read_accessor(document: dict[str, Any], binary: bytes, number: int, width: int) -> NDArray[Any]:
    """Read an accessor of positions (width 3) or indices (width 1)."""
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    kind = np.dtype(np.float32 if accessor["componentType"] == POSITION_TYPE else INDEX_TYPES[accessor["componentType"]])
    stride = view.get("byteStride", kind.itemsize * width)
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    rows = np.ndarray((accessor["count"], width), kind.newbyteorder("<"), binary, start, (stride, kind.itemsize))
    return np.array(rows)
