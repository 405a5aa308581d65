"""An effect from another package, in one file: a magnet beside the track attracts the axis."""

from linid.physics.effects.effect import Effect, term
from linid.physics.parameter import Parameter


@term
def force(t, y, v, i_1, i_2, i_3, record, elapsed, attraction, place, width):
    """Pull towards the place, N."""
    distance = (y - place) / width
    return -attraction * distance / (1.0 + distance * distance)


def grid(outlook):
    """Places along the stroke."""
    places = [outlook.stroke_low + share * outlook.stroke for share in (0.25, 0.5, 0.75)]
    return tuple({"magnet_place": place, "magnet_width": 0.1 * outlook.stroke} for place in places)


EFFECT = Effect(
    name="magnet_beside_track",
    slot="FORCE",
    physics="A magnet beside the track attracts the axis towards one place.",
    parameters=(
        Parameter("magnet_attraction", "F_m", "N", -100.0, 100.0, 0.0, meaning="pull"),
        Parameter("magnet_place", "y_m", "m", -1e3, 1e3, 0.0, meaning="place of the magnet"),
        Parameter("magnet_width", "w_m", "m", 1e-4, 10.0, 0.05, log=True, meaning="reach of the pull"),
    ),
    amplitudes=("magnet_attraction",),
    grid=grid,
    force=force,
    depends_on=(("position",),),
    exposed_by="slow free wheels past the place",
    confused_with=("cogging",),
)
