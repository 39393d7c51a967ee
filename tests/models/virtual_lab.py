"""A laboratory that measures coupons by models other than the closed forms that evaluate its readings.

Bars: the network of printed lines with their turns. Ladder: finite differences in the plane of current. Plates: finite
volumes around the axis, electrodes of finite thickness on a film that ends. Discs: axisymmetric finite elements,
friction by Siebel's formula, a Hencky solid. Lines are extruded too thinly, and one coupon is dead.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import exp, log, pi

import numpy as np
from resistors import potentials
from scipy.interpolate import RectBivariateSpline, RegularGridInterpolator

from sensorgen.analysis import characterise as catalogue
from sensorgen.analysis.characterise.posterior import Observation
from sensorgen.models import traxels
from sensorgen.solvers.network import StraightLines
from sensorgen.verification.chart.networks import plate as lines_of

EPS0 = 8.8541878128e-12
LINE_MM, LAYER_MM = 0.44, 0.1


@dataclass(frozen=True)
class Hidden:
    """What is true of a lab's materials and print [SI]."""

    bulk_ohm_m: float
    line_contact_ohm_m2: float
    through_ohm_m: float
    terminal_ohm_m2: float
    permittivity: float
    gap_m: float
    conductor_pa: float
    dielectric_pa: float
    conductor_1_2nu: float
    dielectric_1_2nu: float
    friction: float  # Coulomb's coefficient of the lubricated plates
    flow: float  # of the conductor's lines, 1 where they fill their pitch
    dead: str


def hidden(rng, names):
    """A lab at random; its conductor conducts along lines about as the sources say, give and take a factor of three."""
    bulk = exp(rng.uniform(log(0.05), log(0.8)))
    return Hidden(
        bulk, bulk * LINE_MM * 1e-3 * exp(rng.uniform(log(0.3), log(3.0))), bulk * rng.uniform(1.2, 4.0),
        exp(rng.uniform(log(3e-5), log(5e-4))), rng.uniform(3.2, 7.5),
        float(np.clip(rng.normal(5e-6, 1e-5), -1.2e-5, 4e-5)),
        exp(rng.uniform(log(8e6), log(4e7))), exp(rng.uniform(log(8e5), log(1e7))),
        exp(rng.uniform(log(2e-3), log(0.1))), exp(rng.uniform(log(2e-3), log(0.1))),
        rng.uniform(1e-3, 0.1), rng.uniform(0.9, 1.0), str(rng.choice(names)),
    )  # fmt: skip


SHARES, FLOWS = np.log([0.2, 0.7, 1.6, 4.0]), np.array([0.89, 0.95, 1.01])  # contact over bulk of a line's width


def resistivity(truth, degrees, width_mm):
    """Of a bar of printed lines [ohm m], between networks of a few contacts and flows."""
    share = log(truth.line_contact_ohm_m2 / (truth.bulk_ohm_m * LINE_MM * 1e-3))
    return truth.bulk_ohm_m * exp(float(_networks(degrees, width_mm)(share, truth.flow)[0, 0]))


@lru_cache
def _networks(degrees, width_mm):
    values = np.log([[network_ratio(exp(s), f, degrees, width_mm) for f in FLOWS] for s in SHARES])
    return RectBivariateSpline(SHARES, FLOWS, values, kx=3, ky=2)


def network_ratio(share, flow, degrees, width_mm):
    """Resistivity of a bar over that of its material; None for walls and crossed layers, as profiles have them [-]."""
    if degrees is not None:
        return aligned_ratio(share, flow, degrees, width_mm)
    lines = lines_of(16.0, width_mm, LINE_MM, LAYER_MM, [45.0, 135.0])
    thin = StraightLines(lines.start_m, lines.end_m, lines.width_m * flow, lines.height_m, lines.layer, lines.joined)
    area = width_mm * 1e-3 * LAYER_MM * 1e-3 * 2
    return traxels.resistance(thin, 1.0, share * LINE_MM * 1e-3, (-5e-3, 5e-3), area).ratio


def aligned_ratio(share, flow, degrees, width_mm, per_line=4, corner=0.5):
    """Resistivity of one layer of parallel lines over the material's: a grid of nodes on every line, and the turns.

    Neighbouring lines are joined at alternating ends, as infill is laid to and fro; at the other end they touch over
    ``corner`` of a line's width more than their middles are long. From bars of two lengths, so that ends do not count.
    """
    longer, shorter = (_bar_ohm(share, flow, degrees, width_mm, per_line, corner, pitches) for pitches in (50, 20))
    outside = int(width_mm / LINE_MM) * LINE_MM if not degrees else width_mm
    return (longer - shorter) * outside * LAYER_MM / (30 * LINE_MM)


def _bar_ohm(share, flow, degrees, width_mm, per_line, corner, pitches):
    """A layer of a bar between ends of one potential, some pitches apart."""
    p, angle = LINE_MM, np.radians(degrees)
    step = p / per_line
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    half = np.array([(pitches + 12) * p, width_mm]) / 2
    inner = half - np.array([0.0, p / 2])
    count = int(np.abs(across) @ half / p) if degrees else int(width_mm / p / 2)
    offsets = (
        (np.arange(2 * count + 1) - count) * p
        if degrees
        else (np.arange(int(width_mm / p)) - (int(width_mm / p) - 1) / 2) * p
    )
    nodes, where, ends = {}, [], []
    for n, off in enumerate(offsets):
        with np.errstate(divide="ignore"):
            cuts = [(s * inner - off * across) / along for s in (-1, 1)]
        lows, highs = np.minimum(*cuts), np.maximum(*cuts)
        keep = np.abs(along) > 1e-9
        low, high = lows[keep].max(), highs[keep].min()
        first, last = int(np.ceil(low / step)), int(np.floor(high / step))
        if last - first < 2 or (abs(along[1]) < 1e-9 and abs(off) > inner[1] + 1e-9):
            continue
        for j in range(first, last + 1):
            nodes[n, j] = len(where)
            where.append(off * across + j * step * along)
        ends.append((n, first, last))
    where = np.array(where)
    area = p * flow * LAYER_MM  # of a line [mm2], of resistivity 1
    links = []
    contact = LAYER_MM * step / (p * (1 + share))
    for (n, j), a in nodes.items():
        if (n, j + 1) in nodes:
            links.append((a, nodes[n, j + 1], area / step))
        if (n + 1, j) in nodes:  # half of it at an end of what both lines have
            inside = {(m, j + d) in nodes for m in (n, n + 1) for d in (-1, 1)} == {True}
            links.append((a, nodes[n + 1, j], contact if inside else contact / 2))
    sides = {n: (first, last) for n, first, last in ends}
    for n, span in sides.items():
        if n + 1 in sides and degrees:
            k = n % 2
            links.append((nodes[n, span[k]], nodes[n + 1, sides[n + 1][k]], area / p))
            links.append((nodes[n, span[1 - k]], nodes[n + 1, sides[n + 1][1 - k]], contact * per_line * corner))
    x, reach = where[:, 0], pitches * p / 2
    held = np.where(np.abs(x) < reach - 1e-6, np.nan, np.where(x > 0, 1.0, 0.0))
    a, b, g = (np.array(of) for of in zip(*links, strict=True))
    u, current = potentials(a, b, g, held)
    return 1.0 / float(u @ current)


def ladder_ohm(along, through, contact, gap_mm, width_mm, height_mm):
    """Two strips of a bar, in the plane of the current; contact resistivities of both [ohm m2]."""
    strip, d = catalogue.STRIP_MM, 0.1
    nx, nz = round((2 * strip + gap_mm) / d), 16
    dx, dz, w = d * 1e-3, height_mm * 1e-3 / nz, width_mm * 1e-3
    gx, gz = w * dz / (along * dx), w * dx / (through * dz)
    index = np.arange(nx * nz).reshape(nx, nz)
    links = [(index[:-1], index[1:], gx), (index[:, :-1], index[:, 1:], gz)]
    x, held = (np.arange(nx) + 0.5) * d, np.append(np.full(nx * nz, np.nan), [0.0, 1.0])
    for k, under in enumerate((x < strip, x > strip + gap_mm)):
        links.append((index[under, -1], nx * nz + k, w * dx / (contact[k] + through * dz / 2)))
    ends = [[of.ravel() for of in np.broadcast_arrays(*link)] for link in links]
    _, current = potentials(*map(np.concatenate, zip(*ends, strict=True)), held)
    return 1.0 / float(current[-1])


def _graded(stops, step, growth=1.25):
    """Grid lines through given places, fine at each of them and growing away from it."""
    found = [stops[0]]
    for a, b in pairwise(stops):
        half, h, at = [], step, 0.0
        while at + h < (b - a) / 2:
            at += h
            half.append(at)
            h *= growth
        if half and (b - a) / 2 - half[-1] < 0.3 * step:
            half.pop()
        found += [a + t for t in half] + [(a + b) / 2] + [b - t for t in half[::-1]] + [b]
    return np.array(found)


def plate_f(thickness_mm, permittivity, radius_mm=catalogue.PLATE_RADIUS_MM, step=0.02):
    """Round plates by finite volumes around the axis [F]."""
    e, rim, t = catalogue.ELECTRODE_MM, catalogue.film_radius_mm(thickness_mm), thickness_mm
    r = _graded([0.0, radius_mm, rim, 60.0], step)
    z = _graded([-45.0, 0.0, e, e + t, e + t + catalogue.UPPER_MM, 50.0], min(step, t / 12))
    rm, zm = (r[1:] + r[:-1]) / 2, (z[1:] + z[:-1]) / 2
    film = (rm[:, None] < rim) & (zm > e) & (zm < e + t)
    eps = np.where(film, permittivity, 1.0)
    dr, dz = np.diff(r), np.diff(z)
    nr, nz = len(r), len(z)
    index = np.arange(nr * nz).reshape(nr, nz)
    radial = eps * (rm / dr)[:, None] * dz / 2
    inner, outer = (rm**2 - r[:-1] ** 2) / 2, (r[1:] ** 2 - rm**2) / 2
    links = [(index[:-1, j : nz - 1 + j], index[1:, j : nz - 1 + j], radial) for j in (0, 1)]
    links += [
        (index[i : nr - 1 + i, :-1], index[i : nr - 1 + i, 1:], eps * area[:, None] / dz)
        for area, i in ((inner, 0), (outer, 1))
    ]
    a, b, g = (np.concatenate([link[k].ravel() for link in links]) for k in range(3))
    near = 1e-9
    lower = (r[:, None] <= rim + near) & (z >= -near) & (z <= e + near)
    upper = (r[:, None] <= radius_mm + near) & (z >= e + t - near) & (z <= e + t + catalogue.UPPER_MM + near)
    u, charge = potentials(a, b, g, np.where(upper, 0.5, np.where(lower, -0.5, np.nan)).ravel())
    return float(2 * pi * EPS0 * 1e-3 * (u @ charge))


@lru_cache
def plate_table(nominal_mm):
    """ln C over thickness and permittivity."""
    t, eps = np.array([0.7, 1.0, 1.4]) * nominal_mm, np.array([1.8, 3.0, 4.5, 7.0, 12.0])
    values = np.log([[plate_f(a, b) for b in eps] for a in t])
    return RegularGridInterpolator((np.log(t), np.log(eps)), values, bounds_error=False, fill_value=None)


@lru_cache
def bonded_factor(radius_mm, height_mm, incompressibility, fine=10):
    """Apparent modulus of a bonded disc over E, by mixed finite elements (displacement P2, pressure P1)."""
    import skfem as fem
    from skfem.helpers import ddot, sym_grad

    nu = (1 - incompressibility) / 2
    g, bulk = 1 / (2 * (1 + nu)), 1 / (3 * incompressibility)
    a, h = radius_mm, height_mm
    s = (1 - np.linspace(1, 0, 2 * fine + 1) ** 2) * a
    mesh = fem.MeshTri.init_tensor(s, np.linspace(0, h / 2, fine + 1))
    basis = fem.Basis(mesh, fem.ElementVector(fem.ElementTriP2()), intorder=4)
    pressure = basis.with_element(fem.ElementTriP1())

    @fem.BilinearForm
    def stiff(u, v, w):
        r = w.x[0] + 1e-12
        eu, ev = sym_grad(u), sym_grad(v)
        return 2 * g * (ddot(eu, ev) + u[0] * v[0] / r**2) * r

    @fem.BilinearForm
    def divergence(u, q, w):
        r = w.x[0] + 1e-12
        return -(u.grad[0, 0] + u.grad[1, 1] + u[0] / r) * q * r

    @fem.BilinearForm
    def compress(p, q, w):
        return -p * q * w.x[0] / (bulk - 2 * g / 3)

    from scipy.sparse import bmat

    k, b, m = stiff.assemble(basis), divergence.assemble(basis, pressure), compress.assemble(pressure)
    whole = bmat([[k, b.T], [b, m]]).tocsr()
    near = 1e-9
    top = basis.get_dofs(lambda x: x[1] > h / 2 - near)
    x = np.zeros(whole.shape[0])
    x[top.all(["u^2"])] = -0.01 * h / 2
    held = np.unique(np.concatenate([
        top.all(), basis.get_dofs(lambda x: x[1] < near).all(["u^2"]),
        basis.get_dofs(lambda x: x[0] < near).all(["u^1"]),
    ]))  # fmt: skip
    x = fem.solve(*fem.condense(whole, np.zeros(len(x)), x=x, D=held))
    energy = 2 * pi * float(x @ (whole @ x)) / 2 if incompressibility > 1 else None
    force = float((whole @ x)[top.all(["u^2"])].sum()) * 2 * pi
    assert energy is None
    return -force / (pi * a**2) / 0.01


def bonded(radius_mm, height_mm, q):
    """The same between tabulated compressibilities."""
    table = (1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3)
    values = [bonded_factor(radius_mm, height_mm, one) for one in table]
    return exp(np.interp(log(q), np.log(table), np.log(values)))


def measured(coupon, truth, meters, rng):
    """A coupon as the lab measures it."""
    actual, sizes = {}, []
    for size in coupon.sizes:
        if size.measured:
            actual[size.key] = size.drawn * (1 + rng.normal(0, 0.01)) + rng.normal(0, 0.03)
            read = actual[size.key] + rng.normal(0, meters.calipers_mm)
            sizes.append(catalogue.CouponSize(size.key, read, meters.calipers_mm, measured=True))
        else:
            sizes.append(size)
    found = _true(coupon, actual, truth, rng)
    noise = np.array([meters.noise(r, v) for r, v in zip(coupon.readings, found, strict=True)])
    values = np.log(found) + rng.normal(0, 1, len(found)) * noise
    if coupon.name == truth.dead:
        values = values + rng.choice([-1, 1]) * rng.uniform(1.0, 4.0) * np.ones(len(values))
    return Observation(coupon, tuple(sizes), values, noise)


def _true(coupon, actual, truth, rng):
    """Readings without the meters' noise [ohm, F, N/m]."""
    fill = 1 + rng.normal(0, 0.01)
    if coupon.kind == "bar":
        rho = resistivity(truth, coupon.degrees, coupon.drawn("width_mm"))
        taps = coupon.drawn("taps_mm") + rng.normal(0, 0.15)
        edge = 1 + rng.uniform(-0.5, 0.5) * LINE_MM / coupon.drawn("width_mm") * (coupon.degrees == 90)
        return [rho * taps / (actual["width_mm"] * actual["height_mm"]) * 1e3 * fill * edge]
    if coupon.kind == "ladder":
        along = resistivity(truth, coupon.degrees, coupon.drawn("width_mm")) * fill
        strips = truth.terminal_ohm_m2 * np.exp(rng.normal(0, 0.05, len(catalogue.LADDER_MM) + 1))
        return [
            ladder_ohm(along, truth.through_ohm_m, strips[k : k + 2], gap, actual["width_mm"], actual["height_mm"])
            + along * rng.normal(0, 0.1) / (actual["width_mm"] * actual["height_mm"]) * 1e3
            for k, gap in enumerate(catalogue.LADDER_MM)
        ]
    if coupon.kind == "plate":
        found, stray = [], rng.normal(0, 0.02e-12)
        for k in range(1, len(coupon.readings) + 1):
            t = actual[f"film_{k}_on_electrode_mm"] - actual["electrode_mm"]
            eps = t * 1e-3 / (t * 1e-3 / truth.permittivity + truth.gap_m)
            nominal = round(coupon.drawn(f"film_{k}_on_electrode_mm") - catalogue.ELECTRODE_MM, 9)
            c = exp(float(plate_table(nominal)((log(t), log(eps)))))
            larger = (actual[f"top_{k}_diameter_mm"] / 2 / catalogue.PLATE_RADIUS_MM) ** 2
            found.append(c * larger * (1 + rng.normal(0, 0.003)) + stray)
        return found
    if coupon.kind == "pads":
        found = []
        for k in range(1, len(coupon.readings) + 1):
            area = pi * (actual[f"diameter_{k}_mm"] / 2e3) ** 2 * fill * (1 - abs(rng.normal(0, 0.01)))
            ends = truth.terminal_ohm_m2 * np.exp(rng.normal(0, 0.05, 2)).sum()
            found.append((truth.through_ohm_m * actual[f"height_{k}_mm"] * 1e-3 + ends) / area)
        return found
    role = "conductor" if coupon.readings[0].key == "through_ohm" else "dielectric"
    e, q = getattr(truth, f"{role}_pa"), getattr(truth, f"{role}_1_2nu")
    a, h = actual["diameter_mm"] / 2, actual["height_mm"]
    area = pi * a**2 * 1e-6 * fill
    rise = 2 * truth.friction * a / h  # of the pressure from rim to middle, by equilibrium of a slab
    slides = e * 2 * (exp(rise) - rise - 1) / rise**2
    sticks = e * bonded(coupon.drawn("diameter_mm") / 2, coupon.drawn("height_mm"), q)
    pressed = [m * area / (h * 1e-3) * (1 + rng.normal(0, 0.01)) for m in (slides, sticks)]
    pressed = pressed[: len(coupon.readings) - (role == "conductor")]
    if role == "dielectric":
        return pressed
    ends = truth.terminal_ohm_m2 * np.exp(rng.normal(0, 0.05, 2)).sum()
    return [(truth.through_ohm_m * h * 1e-3 + ends) / (area * (1 - abs(rng.normal(0, 0.01)))), *pressed]


def true_targets(truth):
    """Hidden values by the quantities of the targets, of the print as it is."""
    line = LINE_MM * 1e-3
    along = truth.bulk_ohm_m / truth.flow
    across = truth.bulk_ohm_m + truth.line_contact_ohm_m2 / line
    return {
        ("conductor", "resistivity_ohm_m"): resistivity(truth, None, 10.0),
        ("conductor", "resistivity_along_ohm_m"): along,
        ("conductor", "resistivity_across_ohm_m"): across,
        ("conductor", "line_contact_ohm_m2"): line * (across - along),
        ("conductor", "resistivity_through_ohm_m"): truth.through_ohm_m,
        ("conductor", "terminal_contact_ohm_m2"): truth.terminal_ohm_m2,
        ("dielectric", "relative_permittivity"): truth.permittivity,
        ("dielectric", "interface_gap_m"): truth.gap_m,
        ("conductor", "youngs_modulus_pa"): truth.conductor_pa,
        ("dielectric", "youngs_modulus_pa"): truth.dielectric_pa,
    }


def filled(text, coupons, truth, meters, rng):
    """A blank form with the lab's readings in it."""
    for coupon in coupons:
        found = measured(coupon, truth, meters, rng)
        head, mark, rest = text.partition(f"  {coupon.name}:\n")
        fields = {s.key: s.drawn for s in found.sizes if s.measured}
        for reading, log_value in zip(coupon.readings, found.log_values, strict=True):
            value = exp(log_value)
            if reading.kind == "stiffness":  # the load that is in the form; compression by bisection
                low, high = 0.0, 0.49 * fields["height_mm"]
                for _ in range(80):
                    u = (low + high) / 2
                    ratio = 1 - u / fields["height_mm"]
                    force = value * u * 1e-3 * (ratio**-2 + 1 / ratio + 1) / 3
                    low, high = (low, u) if force > reading.load_n else (u, high)
                fields[f"{reading.key}_mm"] = low
            else:
                fields[reading.key] = value * (1e12 if reading.kind == "capacitance" else 1.0)
        for key, value in fields.items():
            rest = rest.replace(f"    {key}: ~", f"    {key}: {value:.8g}", 1)
        text = head + mark + rest
    return text
