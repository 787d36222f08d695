"""A whole class: a folder of submissions in, grades and one page about all of them out.

- `finding`     which student handed in what, in the layouts of Canvas, Moodle, Gradescope, GitHub and plain folders
- `layouts`     what names in a platform's download say
- `work`        one submission graded in a process of its own, here or on another machine
- `engines`     where those processes run: this machine's cores, or a Dask cluster
- `ledger`      results on disk, so that no interruption costs or repeats one
- `overrides`   scores set by hand
- `late`        what being late costs
- `again`       one task graded again after an erratum
- `gradebook`   what counts in the end, and `grades.csv`
- `similarity`  advice on who may have copied
- `reports`     each student's report and picture
- `page`        the report about the class
- `tables`      CSV files, written again with every other byte as it was
- `roster`      who is in the class by the platform's own table
- `returning`   what goes back to the platform
- `run`         `grade_class`, which puts it together
"""
