"""Meshes of triangles and tetrahedra: from files, from arrays and from formulas, checked before they are used.

    file or formula -> load / grid / unstructured / sector / Mesh.from_arrays -> Mesh (checked)

A `Mesh` is the undeformed cloth: vertices X (n, 3) in metres and triangles (m, 3). A `TetMesh`, from `load_tets`,
`block` or `ball`, is an undeformed solid: tetrahedra (m, 4), and the triangles of its surface. Whatever cannot be
either is refused with a `MeshError` that names the file, the line or element, how many there are, and what to do.

==============  ============================================================================
`surface`       `Mesh`, and what a simulator asks of triangles: areas, normals, edges, boundary
`checks`        what a mesh must satisfy, and the messages when it does not
`files`         `load` and `save`, and the table of formats
`text`          OBJ and OFF, line by line, so that a message can name the line
`ply` `stl`     PLY and STL, as text and binary
`vtk` `vtkxml`  VTK's files: legacy; VTU and VTP; `vtkcells` says which of their cells are faces
`gmsh`          Gmsh, through meshio on a short leash
`handing`       `taken`: a mesh as callers hand it over
`polygons`      what a file holds before it is triangles, and cutting polygons up
`refusals`      the words for a file that cannot be read
`tets`          `TetMesh`, what it must satisfy, and its surface
`tetfiles`      `load_tets`: from Gmsh and VTK too, and from `medit` and `tetgen`
`shapes`        `grid`, `unstructured`, `sector`
`solids`        `block`, `ball`
`filling`       tetrahedra inside a signed distance, and its surface; `creature` is one
`refinement`    `Refinement`: sqrt(3) refinement where it is wanted, and its coarsening
`describing`    what a mesh is, in a few lines
`shipped`       the meshes in data/meshes, as calls of the generators
==============  ============================================================================
"""

from muslin.mesh.files import load, save
from muslin.mesh.handing import taken
from muslin.mesh.refinement import Refinement
from muslin.mesh.shapes import grid, sector, unstructured
from muslin.mesh.solids import ball, block
from muslin.mesh.surface import (
    Mesh,
    area_and_normal,
    boundary,
    check,
    edges,
    principal_stretches,
    vertex_normals,
)
from muslin.mesh.tetfiles import load_any, load_tets
from muslin.mesh.tets import TetMesh

__all__ = [
    "Mesh",
    "Refinement",
    "TetMesh",
    "area_and_normal",
    "ball",
    "block",
    "boundary",
    "check",
    "edges",
    "grid",
    "load",
    "load_any",
    "load_tets",
    "principal_stretches",
    "save",
    "sector",
    "taken",
    "unstructured",
    "vertex_normals",
]
