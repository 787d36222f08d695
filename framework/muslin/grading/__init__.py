"""Grading: submission -> (sandboxed worker) outputs -> comparison -> diagnosis -> record -> report.

- `submission`  a folder, zip or tar becomes the task files, and nothing else: `unpacking` reads it in a process
  of its own, `choosing` says which of its files are meant
- `sandbox`     the worker process and what keeps it in (`isolation`, `worker`, `wire`)
- `checks`      the layers of a task: form, public cases, hidden cases, `properties`
- `simulating`  all functions together on a small cloth, and the `laws` they must obey
- `diagnosis`   which mistake a wrong answer looks like: `mistakes` that are known, `slips` nobody wrote down
- `reader`      the process in which a submission's text is read: little time and memory, and no grade hangs on it
- `kernels`     what a submission compiled, kept for its own next grading
- `record`      the result; `views` turn it into every format there is
- `grader`      `grade`, which puts it together

The parent neither imports a submission nor reads its text; a worker never sees an expected value.
"""
