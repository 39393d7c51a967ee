"""What the tests have to say besides passing."""


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
