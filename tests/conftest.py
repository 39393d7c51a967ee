"""What the tests have to say besides passing, and a cache of its own for each."""

import pytest


@pytest.fixture(autouse=True)
def _cache(monkeypatch, tmp_path_factory):
    """No test finds what another one, or the user, has kept."""
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path_factory.mktemp("cache")))


def pytest_terminal_summary(terminalreporter):
    """Print the printed volumes beside the solid ones, as the tests of the slicers recorded them."""
    rows = [
        value
        for reports in terminalreporter.stats.values()
        for report in reports
        for name, value in getattr(report, "user_properties", ())
        if name == "volumes"
    ]
    if rows:
        terminalreporter.section("extruded and exact volume per tool")
        for row in sorted(set(rows)):
            terminalreporter.write_line(row)
