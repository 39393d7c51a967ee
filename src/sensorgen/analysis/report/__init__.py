"""What was predicted beside what was measured, and how far apart, for everybody who wants to know."""

from sensorgen.analysis.report.contents import Report, Section, report

FORMATS = ("html", "md", "csv", "json")

__all__ = ["FORMATS", "Report", "Section", "report", "written"]


def written(made: Report, how: str) -> str:
    """A report as text.

    Parameters
    ----------
    made : Report
        As :func:`report` makes it.
    how : str
        One of ``FORMATS``.
    """
    from sensorgen.analysis.report import page, text

    writers = {"html": page.html, "md": text.markdown, "csv": text.comma_separated, "json": text.as_json}
    return writers[how](made)
