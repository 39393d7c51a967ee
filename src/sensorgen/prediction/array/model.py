"""An array in numbers: cell and fringe of every crossing as printed, and the resistance of every track to its pad."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated

import numpy as np

from sensorgen.core.arrays import Mask, Real
from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.document import Column, Table
from sensorgen.core.errors import BadInput, MissingValue
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design.arrays import ArrayLayout, ArrayTrack
from sensorgen.design.body import Body
from sensorgen.design.design import Design
from sensorgen.design.values import material_value
from sensorgen.models.compression import CapacitanceCurve
from sensorgen.models.fem2d import narrowed
from sensorgen.prediction import bodies
from sensorgen.prediction.error_budget import modulus_range
from sensorgen.prediction.query import Query
from sensorgen.prediction.sensor_model import SensorModel
from sensorgen.scene.repetition import Band, SectionCell, Slice
from sensorgen.solvers.cover import ElasticLayer, kernel
from sensorgen.solvers.electrostatics import bounds as fem
from sensorgen.solvers.electrostatics.triangles import insulated
from sensorgen.solvers.tracks import Tracks

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_WIDTH = 3e-3  # of the bounds
_PRESSED = 1.05  # capacitance over that at rest, at which the rise of the whole is compared
_Rows = list[tuple[str, str, float]]


@dataclass(frozen=True)
class Fringe:
    """Fringe of a crossing.

    Attributes
    ----------
    share : Interval and float
        Capacitance of the edges over that of the crossing's own area: best value, and range [-].
    gain : float
        Relative rise of the whole capacitance over that of the crossing's own area [-].
    """

    share: float
    least: float
    most: float
    gain: float


@dataclass(frozen=True)
class CrossingSection:
    """Heights and widths of a crossing [mm] and relative permittivities [-].

    Attributes
    ----------
    column, row : (float, float)
        Width of the track and of the space beside it.
    film, cell, electrode, cover, base : float
        Thicknesses.
    eps : mapping of str to float
        Of "film", "cell", what is "beside" the columns above the film, "solid" between tracks, "cover" and "air".
    """

    column: tuple[float, float]
    row: tuple[float, float]
    film: float
    cell: float
    electrode: float
    cover: float
    base: float
    eps: Mapping[str, float]

    def at(self, ratio: float) -> "CrossingSection":
        """The crossing with its cell pressed to a capacitance over that at rest."""
        film, cell = self.film / self.eps["film"], self.cell / self.eps["cell"]
        return replace(self, cell=self.cell * ((film + cell) / ratio - film) / cell)

    def share(self, lid: str = "") -> float:
        """Capacitance of the edges over that of the crossing's own area [-]."""
        film, cell = ("film", "", self.film), ("cell", "", self.cell)
        columns = self._edges(self.column, [film, cell], [film, ("beside", "", self.cell)], self.cover, lid)
        rows = self._edges(self.row, [cell, film], [cell, film], self.base, lid)
        return (1 + columns) * (1 + rows) - 1

    def _edges(self, widths: tuple[float, float], under: _Rows, beside: _Rows, beyond: float, lid: str) -> float:
        """Share of the edges of one track over a plate: ``beyond`` is the thickness of what lies on it."""
        track, space = (width / 2 for width in widths)
        outside: _Rows = [("", lid, self.electrode)] if lid else [("air", "", track + space)]
        top: _Rows = [("cover", "", beyond), *outside]
        slices = (
            _slice(0.0, track, [("", "bottom", self.electrode), *under, ("", "top", self.electrode), *top]),
            _slice(
                track, track + space, [("", "bottom", self.electrode), *beside, ("solid", "", self.electrode), *top]
            ),
        )
        mesh = insulated(SectionCell(slices, (1.0, 1.0)))
        shares = [share for _, share in mesh.regions]
        c = fem.narrowest(narrowed(mesh, self.eps, lambda found: fem.whole(found, shares), _WIDTH))
        return c.middle() * sum(height / self.eps[name] for name, _, height in under) / track - 1


def _slice(left: float, right: float, rows: _Rows) -> Slice:
    bands, z = [], 0.0
    for material, terminal, height in rows:
        if height > 0:
            bands.append(Band(material, terminal, (z, z), (z + height, z + height)))
            z += height
    return Slice(left, right, tuple(bands))


def fringe(of: CrossingSection) -> Fringe:
    r"""Fringe of a crossing at rest, and its part in the rise.

    The field from the edges of a row or column to the tracks that it crosses. Of two cross-sections, square to the
    columns and square to the rows, each from the middle of a track to the middle of the space beside it, with both as
    mirrors; the cell is the homogeneous layer that has the crossing's capacitance:

    .. math:: C = C_0 (1 + f_x)(1 + f_y)

    The product leaves the corners out: 0.3 % of C by finite volumes in three dimensions. Of what closing a crossing
    does, closing its neighbour does 0.5 %.

    Least: no solid but the film lies beside the tracks; most: a conductor at the tracks' potential lies on the cover.
    """
    rest, pressed = of.share(), of.at(_PRESSED).share()
    bare = replace(of, eps={**of.eps, "beside": of.eps["air"], "solid": of.eps["air"], "cover": of.eps["air"]})
    gain = (_PRESSED * (1 + pressed) / (1 + rest) - 1) / (_PRESSED - 1)
    return Fringe(rest, min(bare.share(), rest), max(of.share("top"), rest), gain)


PA_PER_KPA, PA_PER_MPA = 1e3, 1e6
_USUAL_KPA = 90.0  # pressure on a cell up to which its law is wanted: of 6 N on 8 x 8 mm
_N_PER_KPA_MM2 = 1e-3
_NEWTON = 12  # steps: the law is smooth and nearly straight
_FELT = 1e-4  # of a pressure: less is not spread
_FAR = 0.02  # of the pressed square's own pressure, eight squares away: what lies beside an array would carry some
_RUBBER = 0.48  # Poisson's ratio of a sheet
_FILM = 0.9  # of the reduced gap: a film that is more of it is the cell
SHORT_OHM = 1e3  # of a shorted crossing: one bead of the electrodes' material across the film


@dataclass(frozen=True)
class Wire:
    """A wire of the connector."""

    wire: Annotated[int, Column("wire")]
    track: Annotated[str, Column("track")]
    pad_x_mm: Annotated[float, Column("pad x", "mm")]
    pad_y_mm: Annotated[float, Column("pad y", "mm")]
    lead_mm: Annotated[float, Column("lead", "mm")]
    track_mm: Annotated[float, Column("length of the track", "mm")]
    lead_ohm: Annotated[float, Column("lead", "ohm", si=True)]
    end_ohm: Annotated[float, Column("to the far end", "ohm", si=True)]
    least_ohm: Annotated[float, Column("at least", "ohm", si=True)]
    most_ohm: Annotated[float, Column("at most", "ohm", si=True)]


@dataclass(frozen=True, eq=False)
class ArrayModel:
    """Numbers of an array.

    Attributes
    ----------
    design : Design
        The array.
    crossing : SensorModel
        One crossing as printed.
    row_ohm, column_ohm : Bounds
        Resistance of the tracks per square [ohm].
    lead_ohm : (float, float)
        Of the leads of rows and of columns per square: flat tracks [ohm].
    """

    design: Design
    crossing: SensorModel
    row_ohm: Bounds
    column_ohm: Bounds
    lead_ohm: tuple[float, float]

    @property
    def layout(self) -> ArrayLayout:
        """Tracks in plan."""
        return _layout(self.design)

    @cached_property
    def here(self) -> np.ndarray:
        """Crossings that the outline has, (m, n)."""
        return np.array(self.layout.here)

    @cached_property
    def regions(self) -> dict[str, Mask]:
        """Crossings whose middle lies in each region of the design, (m, n) of bool.

        Raises
        ------
        BadInput
            A region that is no area, or without a crossing.
        """
        import shapely

        p, of, found = self.layout.params, self.layout, {}
        (px, py), (m, n) = p.pitch, self.here.shape
        x = np.array(of.x_mm) - of.x_mm[0] + (p.length_mm - (n - 1) * px) / 2  # from the outline's corner
        y = np.array(of.y_mm) - of.y_mm[0] + (p.width_mm - (m - 1) * py) / 2
        for name, corners in self.design.regions.items():
            if name in ("force", "sigma", "centre"):
                raise BadInput(f"regions.{name}: results have a column of that name; expected another one")
            region = shapely.MultiPoint(corners) if {*map(len, corners)} == {2} else shapely.Point()
            area = region.envelope if len(corners) == 2 else shapely.Polygon(corners) if len(corners) > 2 else region
            inside = self.here & shapely.intersects_xy(area, x[None], y[:, None])
            if not (area.is_valid and area.area and inside.any()):
                raise BadInput(
                    f"regions.{name}: no area with a crossing; expected two corners of a rectangle, or three or more "
                    f"of a polygon, up to {p.length_mm:g}, {p.width_mm:g} mm"
                )
            found[name] = inside
        return found

    @cached_property
    def capacitance(self) -> Bounds:
        """Of one crossing at rest, the fringe at its edges included [F]."""
        own, edges = self.crossing.rest.capacitance, self.fringe
        least, most = 1 + edges.least, 1 + edges.most
        return replace(
            own.times(1 + edges.share, own.unit), lower=own.lower * least, upper=own.upper * most,
            leads=Interval(own.value * least, own.value * most),
        )  # fmt: skip

    @cached_property
    def fringe(self) -> Fringe:
        """Part of the edges of the tracks in the capacitance and in its rise."""
        p, eps = self.layout.params, {
            part: material_value(*self.design.slot(part), "relative_permittivity").value
            for part in ("film", "dielectric", "isolation")
        }  # fmt: skip
        gap = self.crossing.body.cells.first().size_mm[2] - 2 * p.electrode_mm
        film = getattr(self.design.crossing.params, "dielectric_mm", 0.0)
        area_m = p.column_mm * p.row_mm * M_PER_MM
        reduced = EPS0_F_PER_M * area_m / self.crossing.rest.capacitance.value
        if film / eps["film"] > _FILM * reduced or film >= gap:
            film = 0.0
        cell = (gap - film) / (reduced - film / eps["film"])
        values = {
            "film": eps["film"], "cell": cell, "solid": eps["dielectric"], "cover": eps["isolation"], "air": 1.0,
            "beside": 1.0 if p.between == "air" else eps["dielectric"],
        }  # fmt: skip
        (px, py), heights = p.pitch, (film, gap - film, p.electrode_mm, p.isolation_mm, p.base_mm)
        return fringe(CrossingSection((p.column_mm, px - p.column_mm), (p.row_mm, py - p.row_mm), *heights, values))

    @property
    def pitch_area_m2(self) -> float:
        """Area of the surface for each crossing [m2]."""
        px, py = self.layout.params.pitch
        return px * py * M_PER_MM**2

    @cached_property
    def load_factor(self) -> float:
        """Pressure on a cell per pressure on the surface [-].

        Springs side by side under a stiff cover: the cells, and the solid dielectric between them; with air between,
        the cells carry all.
        """
        share = self._share
        if self.layout.params.between == "air":
            return 1 / share
        if getattr(self.design.crossing.params, "period_mm", None) is None:
            return 1.0  # a plate like what is between the tracks
        try:
            cell, wall = self._springs
        except MissingValue:
            return 1.0
        return cell / (share * cell + (1 - share) * wall)

    @property
    def _share(self) -> float:
        """Share of the surface that crossings are [-]."""
        p = self.layout.params
        return p.column_mm * p.row_mm / (p.pitch[0] * p.pitch[1])

    @cached_property
    def _springs(self) -> tuple[float, float]:
        """Stiffness of cells, and of what is between them, per area [Pa/m]."""
        p = self.layout.params
        height_m = (self.crossing.body.cells.first().size_mm[2] - 2 * p.electrode_mm) * M_PER_MM
        cell = self.crossing.law.compression.foundation_stiffness_pa_per_m(height_m)
        if p.between == "air":
            return cell, 0.0
        return cell, material_value(*self.design.slot("dielectric"), "youngs_modulus_pa").value / height_m

    @cached_property
    def cover(self) -> tuple[ElasticLayer, ...]:
        """Layers on the cells, from below: columns and isolation as one, then a sheet."""
        p = self.layout.params
        parts = {"top_electrode": p.electrode_mm, "isolation": p.isolation_mm}
        thick = sum(parts.values())
        modulus, nu = (
            sum(mm * material_value(*self.design.slot(part), of).value for part, mm in parts.items()) / thick
            for of in ("youngs_modulus_pa", "poisson_ratio")
        )
        own = ElasticLayer(thick * M_PER_MM, modulus, nu)
        return (own, ElasticLayer(p.cover_mm * M_PER_MM, p.cover_mpa * PA_PER_MPA, _RUBBER)) if p.cover_mm else (own,)

    @cached_property
    def kernel(self) -> Real:
        """Pressure that squares carry for 1 on that at (0, 0), by rows and columns; of unknown moduli there alone."""
        (px, py), alone = self.layout.params.pitch, np.zeros((2, 2))
        alone[0, 0] = 1.0
        try:
            cell, wall = self._springs
            of = kernel(self.cover, self._share * cell + (1 - self._share) * wall, (py * M_PER_MM, px * M_PER_MM))
        except MissingValue:
            return alone
        if np.abs(of[len(of) // 2]).max() > _FAR * of[0, 0]:
            p = self.layout.params
            raise BadInput(
                f"cover_mm {p.cover_mm:g} of cover_mpa {p.cover_mpa:g}: it spreads a press over more than {len(of)} "
                "crossings, beyond the array; expected a thinner or softer sheet"
            )
        return of

    @cached_property
    def spread(self) -> "csr_array":
        """Pressures that crossings carry by those on the surface of each, (m n, m n); nothing lies beside the array."""
        from scipy.sparse import csr_array

        of, here = self.kernel, self.here
        i, j = np.nonzero(here)
        (m, n), reach = here.shape, len(of) // 2
        rows, columns, values = [np.flatnonzero(~here)], [np.flatnonzero(~here)], [np.ones(int((~here).sum()))]
        for di, dj in np.argwhere(np.abs(of) > _FELT).tolist():
            a, b = (i + (di + reach) % len(of) - reach), (j + (dj + reach) % len(of) - reach)
            inside = (a >= 0) & (a < m) & (b >= 0) & (b < n)
            inside[inside] = here[a[inside], b[inside]]
            rows.append((a * n + b)[inside])
            columns.append((i * n + j)[inside])
            values.append(np.full(int(inside.sum()), of[di, dj]))
        at = tuple(np.concatenate(each) for each in (rows, columns))
        return csr_array((np.concatenate(values), at), shape=(m * n, m * n))

    @property
    def undone(self) -> float:
        """Factor by which standard errors grow where the spread is undone, of an array without ends [-]."""
        return float(np.sqrt(np.mean(np.abs(np.fft.fft2(self.kernel)) ** -2.0)))

    def carried(self, pressure: Real) -> Real:
        """Pressures that crossings carry by those on the surface, (k, m, n)."""
        return np.asarray((self.spread @ pressure.reshape(len(pressure), -1).T).T.reshape(pressure.shape))

    @cached_property
    def known_pa(self) -> float:
        """Pressure on the surface up to which the law of the cell is known, further straight; infinite of a plate."""
        law = self.crossing.law.compression
        return law.stress_pa[-1] / self.load_factor if isinstance(law, CapacitanceCurve) else float("inf")

    @cached_property
    def shared_factor(self) -> tuple[float, float]:
        """Least and largest true pressure per stated one, of all crossings at once, by the moduli's sources [-]."""
        return modulus_range(self.crossing)[:2]

    def shared(self) -> Iterator[str]:
        """A line of that factor; none where the law of the cell is measured."""
        (low, high), words = self.shared_factor, modulus_range(self.crossing)[2]
        if low < high:
            yield (
                f"all pressures and forces share a factor {low:.2g} to {high:.2g}: stiffness by its sources ({words}); "
                "press with a known weight"
            )

    def beyond(self, kpa: Real) -> Iterator[str]:
        """A line where pressures lie beyond the law of the cell."""
        if count := int((kpa * PA_PER_KPA > self.known_pa).sum()):
            of = f"the peak of {count} of {kpa.size} frames" if kpa.size > 1 else f"{kpa[0]:.4g} kPa"
            yield f"extrapolated: {of} exceeds {self.known_pa / PA_PER_KPA:.0f} kPa, where the law of the cell ends"

    def under(self, pressure_pa: Real) -> tuple[Real, Real]:
        """Capacitance over that at rest [-] and its derivative by the pressure on the surface [1/Pa].

        Beyond the last pressure of the law, and below 0, it goes on straight.
        """
        law, pressure_pa = self.crossing.law.compression, np.asarray(pressure_pa, float)
        inside = np.clip(pressure_pa, 0.0, self.known_pa)
        strain, slope = law.capacitive_strain(inside * self.load_factor)
        slope = self.fringe.gain * slope * self.load_factor / (1 - strain) ** 2
        rise = self.fringe.gain * strain / (1 - strain)
        return np.asarray(1 + rise + (pressure_pa - inside) * slope), np.asarray(slope)

    def pressures(self, ratio: Real) -> tuple[Real, Real]:
        """Pressure on the surface by capacitance over that at rest [Pa], and its derivative [Pa]: Newton's method."""
        pressure = (np.asarray(ratio) - 1) / self.under(np.zeros(1))[1]
        for _ in range(_NEWTON):
            value, slope = self.under(pressure)
            pressure = pressure + (ratio - value) / slope
        return np.asarray(pressure), np.asarray(1 / self.under(pressure)[1])

    def capacitances(self, ratio: "Real | float" = 1.0) -> Real:
        """Of all crossings, those of leads outside the outline at rest, (m, n) [F]."""
        per_mm2 = self.capacitance.value / (self.layout.params.column_mm * self.layout.params.row_mm)
        return np.where(self.here, self.capacitance.value * np.asarray(ratio), per_mm2 * self._lead_crossings_mm2)

    @cached_property
    def _lead_crossings_mm2(self) -> Real:
        """Area in which leads cross other tracks outside the outline, (m, n) [mm2]."""
        found = np.zeros(self.here.shape)
        if self.here.all():
            return found
        import shapely

        rows, columns = ([self.layout.plan(t) for t in tracks] for tracks in (self.layout.rows, self.layout.columns))
        shared = shapely.area(shapely.intersection(np.array(rows)[:, None], np.array(columns)[None]))
        i, j = ([int(t.name[1:]) - 1 for t in tracks] for tracks in (self.layout.rows, self.layout.columns))
        found[np.ix_(i, j)] = shared
        return np.where(self.here, 0.0, found)

    def tracks(self, capacitance_f: "Real | None" = None, ohm: float = 1.0) -> Tracks:
        """The network, its resistances by a factor.

        Parameters
        ----------
        capacitance_f : (m, n) array, optional
            Of the crossings; at rest if not given [F].
        ohm : float
            Factor of all resistances [-].
        """
        of, (m, n) = self.layout, self.here.shape
        row_ohm, column_ohm = np.full((m, n - 1), np.inf), np.full((n, m - 1), np.inf)
        row_lead, column_lead = np.full(m, np.inf), np.full(n, np.inf)
        for i, track in ((int(t.name[1:]) - 1, t) for t in of.rows):
            row_ohm[i], row_lead[i] = self._stretches(track, of.x_mm)
        for j, track in ((int(t.name[1:]) - 1, t) for t in of.columns):
            column_ohm[j], column_lead[j] = self._stretches(track, of.y_mm)
        c = self.capacitances() if capacitance_f is None else capacitance_f
        return Tracks(
            c, ohm * row_ohm, ohm * column_ohm.T, ohm * row_lead, ohm * column_lead, np.zeros(m, dtype=np.int64),
            np.zeros(n, dtype=np.int64), self.crossing.lost.tan_delta, np.zeros((m, n)),
        )  # fmt: skip

    def _stretches(self, track: ArrayTrack, at_mm: Sequence[float]) -> tuple[Real, float]:
        """Resistances between crossings, infinite beyond the track's end, and from crossing 0 to the pad [ohm]."""
        start, per_track, per_lead = self._per_mm(track)
        ends = np.asarray(at_mm)
        ohm = np.where(ends < start, (ends - start) * per_lead, (ends - start) * per_track)
        stretches = np.where(np.arange(1, len(ends)) <= track.last, np.diff(ohm), np.inf)
        return stretches, float(track.lead_length_mm * per_lead + ohm[0])

    def _per_mm(self, track: ArrayTrack) -> tuple[float, float, float]:
        """Where a track begins along itself [mm], and resistances of track and lead per length [ohm/mm]."""
        p, is_row = self.layout.params, track.name.startswith("r")
        sheet, width = (self.row_ohm, p.row_mm) if is_row else (self.column_ohm, p.column_mm)
        return track.body[0 if is_row else 2], sheet.value / width, self.lead_ohm[0 if is_row else 1] / p.lead_mm

    def wires(self) -> tuple[Wire, ...]:
        """Wires of the connector from left to right: first the rows, then the columns."""
        found = sorted([*self.layout.rows, *self.layout.columns], key=lambda t: t.pad[0])
        return tuple(self._wire(k, track) for k, track in enumerate(found, 1))

    def _wire(self, number: int, track: ArrayTrack) -> Wire:
        _, per_track, per_lead = self._per_mm(track)
        x0, x1, y0, y1 = track.body
        is_row = track.name.startswith("r")
        length, sheet = (x1 - x0, self.row_ohm) if is_row else (y1 - y0, self.column_ohm)
        lead = track.lead_length_mm * per_lead
        whole = lead + length * per_track
        pad_x, pad_y = ((track.pad[k] + track.pad[k + 1]) / 2 for k in (0, 2))
        return Wire(
            number, track.name, round(pad_x, 3), round(pad_y, 3), round(track.lead_length_mm, 3), round(length, 3),
            lead, whole, whole * sheet.lower / sheet.value, whole * sheet.upper / sheet.value,
        )  # fmt: skip


def wire_table(design: Design) -> Table:
    """Wires of an array's connector, for which nothing is pressed; BadInput of any other design."""
    from sensorgen.prediction.sensor_model import rough_sensor

    _layout(design)
    return Table.of("wires", "", _of_crossing(design, rough_sensor(bodies.default_body(design.crossing))).wires())


def array_model(design: Design, body: Body | None = None) -> ArrayModel:
    """Numbers of an array as printed: by G-code of one crossing where a slicer is there, else estimated.

    Parameters
    ----------
    design : Design
        An array.
    body : Body, optional
        Of one crossing, in place of that.

    Raises
    ------
    BadInput
        A design that is no array.
    SensorgenError
        What one crossing cannot be predicted for, as :func:`sensorgen.prediction.sensor_model.sensor_model`.
    """
    from sensorgen.prediction.sensor_model import sensor_model

    p = _layout(design).params
    query = Query(force_n=_USUAL_KPA * p.column_mm * p.row_mm * _N_PER_KPA_MM2)
    return _of_crossing(design, sensor_model(body or bodies.default_body(design.crossing), query)[0])


def _layout(design: Design) -> ArrayLayout:
    """Layout of an array; BadInput of any other design."""
    if not design.layout:
        raise BadInput(f"{design.name}: {design.shape} has no crossings; expected shape: array")
    return design.layout


def _of_crossing(design: Design, model: SensorModel) -> ArrayModel:
    """An array of crossings of one model, with the resistances of its tracks."""
    p = _layout(design).params
    top, bottom = (model.rest.resistance[end] for end in ("top", "bottom"))
    scene = model.body.cells.first()
    mean_mm = sum(b.volume_mm3() for b in scene.bodies if b.terminal == "top") / (scene.size_mm[0] * scene.size_mm[1])
    rho_top, rho_bottom = model.rest.resistivity_ohm_m
    # Current in columns runs along y, where the cell's cross-section is the same, so that its mean thickness counts
    column = top.times(rho_top / (mean_mm * M_PER_MM) / top.value, "ohm")
    flat = p.electrode_mm * M_PER_MM
    return ArrayModel(
        design, model, bottom.times(p.row_mm / p.column_mm, "ohm"), column, (rho_bottom / flat, rho_top / flat)
    )
