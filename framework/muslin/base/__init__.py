"""What everything stands on: errors, paths, the engine, processes, text; it knows no mesh and no assignment."""
