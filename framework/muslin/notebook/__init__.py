"""Notebooks: one made from the handout, cells that write into task files, and results that show themselves.

    handout, stubs ──► making.notebook ──► cloth.ipynb
    %%task phi     ──► cells.written ──► shape_functions.py ──► check ──► shows.Verdicts
    a run          ──► shows: a still, the energies, a film, a view to turn

A notebook is a face of the workspace it lies in: the task files stay what is checked, run and handed in.
"""

from muslin.notebook.making import notebook, write
from muslin.notebook.shows import film, view

__all__ = ["film", "notebook", "view", "write"]
