"""Displacement and capacitance of a cell over stress, as a picture."""

from collections.abc import Mapping
from io import BytesIO
from typing import Any

KPA, UM, NF = "stress [kPa]", "displacement of the top [µm]", "capacitance [nF/m²]"


def png(data: Mapping[str, Any]) -> bytes:
    """A picture of what :func:`sensorgen.prediction.compression.answer` found, as PNG.

    Parameters
    ----------
    data : mapping
        Its answer.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    known = [
        (p, 1e9 * low, 1e9 * high)
        for p, low, high in zip(*(data[k] for k in ("stress_kpa", "lower_f_per_m2", "upper_f_per_m2")), strict=True)
        if low is not None
    ]
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(8.4, 3.4) if known else (4.4, 3.4), layout="constrained")
        axes = figure.subplots(1, 2 if known else 1, squeeze=False)[0]
        axes[0].plot(data["stress_kpa"], data["displacement_um"], "o-", ms=3, clip_on=False, color="#0072b2")
        axes[0].set(xlabel=KPA, ylabel=UM, xlim=(0, None), ylim=(0, None))
        if known:
            stress, low, high = zip(*known, strict=True)
            axes[1].plot(stress, high, "v", ms=4, clip_on=False, color="#d55e00", label="upper bound")
            axes[1].plot(stress, low, "^", ms=4, clip_on=False, color="#0072b2", label="lower bound")
            axes[1].set(xlabel=KPA, ylabel=NF, xlim=(0, None))
            axes[1].legend(frameon=False)
        for ax in axes:
            ax.grid(alpha=0.3)
        held = ", ".join(f"{key} {value}" for key, value in data["held"].items())
        figure.suptitle(f"{data['model']}: {held}", fontsize=9)
        file = BytesIO()
        figure.savefig(file, format="png", dpi=150)
    return file.getvalue()
