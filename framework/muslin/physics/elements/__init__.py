"""Finite elements: positions in; energies, gradients and Hessians out, one row per cell.

Every element has the face that `element.Element` says. There are two of triangles:

- `student.StudentElement` carries the 3x3 deformation gradient of the lecture and calls the student's functions:
  all of them in one kernel (`fused`), one by one (`singly`) to say what went wrong, and with what `lecture` does
  around them on the lecture's road to the Hessian;
- `native.NativeElement` is the framework's own 3x2 element in closed form.

A triangle's closed-form Hessian is kept as its modes (`modes`), any other as 3x3 blocks. `pattern` sums rows into
vectors and sparse matrices of the whole body, in whatever `layout` a solver wants; `contact` calls the collision
functions; `limit` keeps triangles from being stretched too far.
Kernels have files of their own: `<module>_kernels` where they serve one module.
"""
