"""A design as drawn and as printed, as lines for the terminal."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sensorgen.cli.show import si


def lines(found: Mapping[str, Any]) -> Iterator[str]:
    """The whole comparison.

    Parameters
    ----------
    found : mapping
        As of :func:`sensorgen.asprinted.report.report`.
    """
    yield f"{found['design']}, as drawn and as printed: {found['source']}"
    if found["estimate"]:
        yield "an ESTIMATE: no slicer was asked; --slicer prusa or cura does"
    yield ""
    yield f"{'':18}{'drawn':>12}   printed"
    low, high = found["electrode_gap_mm"]["printed"]
    gap = f"{low:g} mm" if low == high else f"{low:g} .. {high:g} mm"
    yield f"{'electrode gap':18}{found['electrode_gap_mm']['drawn']:>9g} mm   {gap}"
    yield from _capacitance(found["capacitance_f"])
    yield from _resistance(found["electrode_resistance_ohm"], found["contact_ohm_m2"])
    yield ""
    yield from table(found["layers"])


def _capacitance(c: Mapping[str, Any]) -> Iterator[str]:
    drawn = c["drawn"] if isinstance(c["drawn"], str) else si(c["drawn"]["middle"], "F")
    if c["printed"] is None:
        yield f"{'capacitance':18}{drawn:>12}   none: {next(iter(c['by_width'].values()))}"
        return
    yield f"{'capacitance':18}{drawn:>12}   {si(c['printed']['lower'], 'F')} .. {si(c['printed']['upper'], 'F')}"
    for name, value in c["by_width"].items():
        said = value if isinstance(value, str) else si(value["middle"], "F")
        yield f"{'  lines by ' + name:30}   {said}"


def _resistance(r: Mapping[str, Any], contacts: Sequence[float]) -> Iterator[str]:
    if r["drawn"] is None:
        yield f"{'electrodes':18}{'':12}   {r['reason']}"
        return
    for end, solid in r["drawn"].items():
        yield f"{end + ' electrode':18}{si(solid, 'ohm'):>12}"
        for contact, value in zip(contacts, r["printed"][end], strict=True):
            yield f"{f'  contacts {contact:g} ohm m2':30}   {si(value, 'ohm')}"


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Printed over exact volume of every body, layer by layer from the top.

    Parameters
    ----------
    rows : sequence of mapping
        As of :class:`sensorgen.asprinted.tally.Row`, with "ratio".
    """
    bodies = list(dict.fromkeys(row["body"] for row in rows))
    cells = {(row["layer"], row["body"]): _cell(row) for row in rows}
    spans = {row["layer"]: f"{row['bottom_mm']:g}-{row['top_mm']:g}" for row in rows}
    yield "printed over exact volume (strips lost or fused)"
    yield f"{'layer':>5} {'mm':11}" + " ".join(f"{name:>{_wide(name)}}" for name in bodies)
    for layer in sorted(spans, reverse=True):
        row = " ".join(f"{cells.get((layer, name), ''):>{_wide(name)}}" for name in bodies)
        yield f"{layer:>5} {spans[layer]:11}{row}".rstrip()


def _wide(name: str) -> int:
    return max(len(name), 12)


def _cell(row: Mapping[str, Any]) -> str:
    lost = f" -{row['vanished']}" if row["vanished"] else ""
    fused = f" +{row['fused']}" if row["fused"] else ""
    return f"{'extra' if row['ratio'] is None else format(row['ratio'], '.2f')}{lost}{fused}"
