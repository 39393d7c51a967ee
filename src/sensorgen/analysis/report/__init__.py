"""Predictions and measurements of an iteration, compared."""

from sensorgen.analysis.report.contents import FORMATS, Report, pieces, report, written

__all__ = ["FORMATS", "Report", "pieces", "report", "written"]
