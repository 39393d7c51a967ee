"""A fit as a source: the YAML file that materials are read from."""

from sensorgen.analysis.fit.results import Fit
from sensorgen.core.version import __version__
from sensorgen.design.materials import own


def text(fit: Fit) -> str:
    """The file of the source.

    Parameters
    ----------
    fit : Fit
        As :func:`sensorgen.analysis.fit.fit` makes it.
    """
    about = (
        f"fit of {fit.of}: {fit.specimens} specimens, {len(fit.held_back)} held back (seed "
        f"{fit.seed}); sensorgen {__version__}; data {fit.log[:16]}"
    )
    materials: dict[str, list[own.SourceValue]] = {}
    for one in fit.values:
        value = own.SourceValue(one.quantity, one.value, one.low, one.high, one.note)
        materials.setdefault(one.material, []).append(value)
    open_ = (f"not determined: {' '.join(f'{untold.parameter}: {untold.why}'.split())}" for untold in fit.untold)
    return own.written(about, materials, open_)
