"""The fixtures of `attacking`, for every attack."""

from attacking import _apart, _honest_records, _session_folder, attack, level  # noqa: F401


def pytest_configure(config):
    config.addinivalue_line("markers", "with_simulation: also run the whole simulation, as grading does")
