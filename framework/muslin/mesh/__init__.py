"""Triangle meshes: from files, from arrays and from formulas, checked before anything is simulated.

    file or formula -> load / grid / unstructured / sector / Mesh.from_arrays -> Mesh (checked)

A `Mesh` is the undeformed cloth: vertices X (n, 3) in metres and triangles (m, 3). Whatever cannot be cloth
is refused with a `MeshError` that names the file, the line or element, how many there are, and what to do.

==============  ============================================================================
`surface`       `Mesh`, and what a simulator asks of triangles: areas, normals, edges, boundary
`checks`        what a mesh must satisfy, and the messages when it does not
`files`         `load` and `save`, and the table of formats
`text`          OBJ and OFF, line by line, so that a message can name the line
`ply` `stl`     PLY and STL, as text and binary
`vtk` `vtkxml`  VTK's files: legacy; VTU and VTP; `vtkcells` says which of their cells are faces
`gmsh`          Gmsh, through meshio on a short leash
`polygons`      what a file holds before it is triangles, and cutting polygons up
`refusals`      the words for a file that cannot be read
`shapes`        `grid`, `unstructured`, `sector`
`shipped`       the meshes in data/meshes, as calls of the generators
==============  ============================================================================
"""

from muslin.mesh.files import load, save
from muslin.mesh.shapes import grid, sector, unstructured
from muslin.mesh.surface import (
    Mesh,
    area_and_normal,
    boundary,
    check,
    edges,
    principal_stretches,
    vertex_normals,
)

__all__ = [
    "Mesh",
    "area_and_normal",
    "boundary",
    "check",
    "edges",
    "grid",
    "load",
    "principal_stretches",
    "save",
    "sector",
    "unstructured",
    "vertex_normals",
]
