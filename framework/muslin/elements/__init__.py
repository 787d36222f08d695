"""Finite elements: positions in; energies, nodal gradients and element Hessians out, one row per triangle.

Two elements with the same face (`update`, `compute`, `energies`, `gradients`, and the arrays `gradient_rows` and
`rows` that hold gradients and Hessians):

- `student.StudentElement` carries the 3x3 deformation gradient of the lecture and calls the student's functions;
- `native.NativeElement` is the framework's own 3x2 element in closed form.

A closed-form Hessian is kept as its modes (`modes`), the lecture's as nine 3x3 blocks. `pattern` sums rows into
vectors and sparse matrices of the whole cloth, in whatever `layout` a solver wants; `launch` makes a kernel cheap
to call again; `contact` calls the collision functions; `conjugate_gradients` is the iterative solver's kernel.
"""
