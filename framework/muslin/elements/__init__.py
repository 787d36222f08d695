"""Finite elements: positions in; energies, nodal gradients and element Hessians out, one row per triangle.

Two elements with the same face (`update`, `energies`, `gradients`, `hessians`):

- `student.StudentElement` carries the 3x3 deformation gradient of the lecture and calls the student's functions;
- `native.NativeElement` is the framework's own 3x2 element in closed form.

`pattern.Pattern` sums their rows into vectors and sparse matrices of the whole cloth.
"""
