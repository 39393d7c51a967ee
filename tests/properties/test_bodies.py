"""Any parameters that a design accepts give closed, oriented bodies that do not overlap, with closed-form volumes.

More than the checks accept: what no nozzle prints must be valid, too. The closed forms are written from
geometry.md, as profiles over the distance from an apex and as strips of a period; they share no code with the shapes.
"""

import manifold3d
import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from sensorgen.checks.review import review
from sensorgen.design.design import make, parameters
from sensorgen.design.shapes import rect, tri
from sensorgen.scene.geometry import meshes
from sensorgen.scene.scene import Fill, Scene


def held(check, count):
    """Assert a property of so many examples."""
    settings(deadline=None, derandomize=True, max_examples=count, suppress_health_check=[HealthCheck.too_slow])(check)()


def counts(few, every):
    """So many examples each time, and so many nightly."""
    return pytest.mark.parametrize("count", [few, pytest.param(every, marks=pytest.mark.nightly)])


def lengths(low: float, high: float) -> st.SearchStrategy[float]:
    """Lengths in whole micrometres, as a drawing has them [mm]."""
    return st.integers(round(low * 1000), round(high * 1000)).map(lambda um: um / 1000)


SIZE = {"length_mm": lengths(1.0, 12.0), "width_mm": lengths(1.0, 9.0), "electrode_mm": lengths(0.01, 2.0)}
FILM = st.just(0.0) | lengths(0.001, 2.0)
OPTIONS = {"isolation_mm": st.just(0.0) | lengths(0.001, 1.0), "dielectric_mm": FILM}
FILLS = st.builds(Fill, film=st.sampled_from(["x60", "pla"]), support=st.sampled_from(["", "bvoh"]))
TURNED = st.booleans()

TRI = st.fixed_dictionaries(
    SIZE
    | OPTIONS
    | {
        "period_mm": lengths(0.3, 5.0),
        "hang_height_mm": lengths(0.011, 3.0),
        "lower_height_mm": lengths(0.01, 2.9),
        "along": st.sampled_from(["x", "y"]),
    }
)
RECT = st.fixed_dictionaries(
    SIZE
    | OPTIONS
    | {
        "etpu_width_mm": lengths(0.1, 2.0),
        "air_width_mm": lengths(0.1, 2.0),
        "x60_width_mm": lengths(0.1, 2.0),
        "upper_height_mm": lengths(0.01, 2.0),
        "lower_height_mm": lengths(0.01, 2.0),
        "along": st.sampled_from(["xy", "yx"]),
    }
)


def by_material(scene: Scene, made) -> dict[str, float]:
    """Volume of the meshes of each material, as trimesh computes it, and each body judged by two programs."""
    found: dict[str, float] = {}
    for body in scene.bodies:
        mesh = made[body.name]
        other = trimesh.Trimesh(mesh.vertices_mm, mesh.triangles, process=False)
        assert other.is_watertight
        assert other.is_winding_consistent
        assert mesh.solid().status() == manifold3d.Error.NoError
        found[body.material] = found.get(body.material, 0.0) + float(other.volume)
    return found


def assert_bodies(scene: Scene, volumes_mm3: dict[str, float]) -> None:
    made = {body.name: meshes.mesh(body) for body in scene.bodies}
    assert meshes.faults(scene, made) == []
    expected = {material: v for material, v in volumes_mm3.items() if v > 0}
    assert by_material(scene, made) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def ridges(end: float, period: float, height: float, apexes: float) -> float:
    """Area from 0 to end under triangles of base period / 2, one per period, the first with its apex at ``apexes``."""
    kinks = np.arange(0.0, end + period, period / 4)
    places = np.unique(np.append(kinks[kinks < end], end))
    away = np.abs((places - apexes + period / 2) % period - period / 2)
    profile = height * np.clip(1 - away / (period / 4), 0, None)
    return float(np.sum((profile[1:] + profile[:-1]) / 2 * np.diff(places)))


@counts(15, 150)
def test_tri(count):
    held(given(TRI, FILLS, TURNED)(tri_is_sound), count)


def tri_is_sound(options, fill, turned):
    assume(options["lower_height_mm"] < options["hang_height_mm"])
    p = parameters("tri", options)
    end, depth = (p.length_mm, p.width_mm) if p.along == "x" else (p.width_mm, p.length_mm)
    cog = ridges(end, p.period_mm, p.hang_height_mm, 0.25 * p.period_mm)
    hanging = ridges(end, p.period_mm, p.hang_height_mm, 0.75 * p.period_mm)
    lower = sum(ridges(end, p.period_mm, p.lower_height_mm, place * p.period_mm) for place in (0.0, 0.5))
    floor = p.length_mm * p.width_mm
    volumes = dict.fromkeys(("etpu", "x60", "pla", "bvoh"), 0.0)
    volumes["etpu"] = 2 * p.electrode_mm * floor + cog * depth
    volumes["x60"] = (hanging + lower) * depth + p.isolation_mm * floor
    volumes[fill.film] += p.dielectric_mm * floor
    volumes["bvoh"] = (p.hang_height_mm * end - cog - hanging - lower) * depth if fill.support else 0.0
    scene = tri.scene(p, fill)
    assert_bodies(scene.turned_over() if turned else scene, volumes)


def covered(end: float, period: float, start: float, width: float) -> float:
    """Length of the strips between 0 and end, one of a width in each period."""
    whole = int(end // period)
    return whole * width + min(max(end - whole * period - start, 0.0), width)


@counts(15, 150)
def test_rect(count):
    held(given(RECT, FILLS, TURNED)(rect_is_sound), count)


def rect_is_sound(options, fill, turned):
    p = parameters("rect", options)
    etpu, air, x60 = p.etpu_width_mm, p.air_width_mm, p.x60_width_mm
    period, floor = etpu + x60 + 2 * air, p.length_mm * p.width_mm

    def layer(along: str, height: float) -> dict[str, float]:
        """Strips along x repeat over the width, those along y over the length."""
        end, length = (p.width_mm, p.length_mm) if along == "x" else (p.length_mm, p.width_mm)
        parts = {
            "etpu": covered(end, period, 0.0, etpu),
            "x60": covered(end, period, etpu + air, x60),
            "bvoh": covered(end, period, etpu, air) + covered(end, period, etpu + air + x60, air),
        }
        return {name: share * length * height for name, share in parts.items()}

    upper, lower = layer(p.along[0], p.upper_height_mm), layer(p.along[1], p.lower_height_mm)
    volumes = {name: upper[name] + lower[name] for name in upper} | {"pla": 0.0}
    volumes["etpu"] += 2 * p.electrode_mm * floor
    volumes["x60"] += p.isolation_mm * floor
    volumes[fill.film] += p.dielectric_mm * floor
    volumes["bvoh"] *= bool(fill.support)
    scene = rect.scene(p, fill)
    assert_bodies(scene.turned_over() if turned else scene, volumes)


DESIGNS = st.one_of(
    *(
        st.fixed_dictionaries(
            {
                "shape": st.just(name),
                "parameters": parameters_of,
                "orientation": st.sampled_from(["as-drawn", "upside-down"]),
                "quality": st.sampled_from(["fine", "extrafine"]),
                "shrinkage": st.sampled_from([0.0, 0.2]),
                "materials": st.sampled_from([{}, {"support": "bvoh"}]),
            }
        )
        for name, parameters_of in (
            ("tri", TRI.filter(lambda p: p["lower_height_mm"] < p["hang_height_mm"])),
            ("rect", RECT),
            ("reference", st.fixed_dictionaries(SIZE | OPTIONS)),
        )
    )
)


def gap_mm(design) -> float:
    """The film; more in a sensor that ends before the first apex, a quarter of a period from its edge."""
    p = design.params
    if design.shape != "tri":
        return p.dielectric_mm
    end = p.length_mm if p.along == "x" else p.width_mm
    return p.dielectric_mm + p.hang_height_mm * max(0.0, 1 - end / (p.period_mm / 4))


@counts(10, 120)
def test_a_review_finds_no_fault_of_sensorgen(count):
    held(given(DESIGNS)(reviewed), count)


def reviewed(data):
    """Whatever else is wrong with a design, its bodies are valid, and its electrodes are apart by the film."""
    design = make(data)
    held = review(design)
    assert not any(f.rule == "0-body" for f in held.findings)
    expected = gap_mm(design)
    assert meshes.electrode_gap_mm(design.printed, held.meshes) == pytest.approx(expected, abs=1e-9)
    assert any(f.rule == "1-short" for f in held.findings) is (expected == 0)
