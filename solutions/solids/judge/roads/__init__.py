"""Ways to write each function, and known detours: what the names of mistakes are made from.

Every function is a road to one task, `<task>` or `<task>__<which road>`, in a file named like the task's and in the
notation of the task files. `muslin.authoring.mutations` changes one thing in it at a time and notes what that makes of
the public cases. The comment of a line says what the line computes, in words that fit after "in"; it is all a student
is told of it.

A function whose docstring has two paragraphs is no road but a mistake as a whole: what to say, and one next step.
"""
