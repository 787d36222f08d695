"""The student's loop: from an empty folder to a submission.

A *workspace* is the folder a student works in. What flows: source text of a workspace -> (a worker process)
reports -> what Muslin remembers in the workspace -> lists, hints, a simulation, a zip. Student code runs in a
worker process only, or in a simulation of functions that have passed: what crashes there is told, not suffered.

- `workspace`  make one, find one, what is remembered in it
- `source`     the anatomy of a student's file: which lines are whose
- `worker`     a process that may crash
- `checking`   a task against the public cases and its properties: report, likely mistake, next step
- `progress`   where every task stands
- `watching`   check on save
- `upgrading`  a newer release, merged around what the student wrote
- `running`    a scene with the student's own functions
- `submitting` the zip to hand in
- `explaining` one case, step by step
- `gradcheck`  derivatives against differences

The commands are in `muslin.cli.student`.
"""
