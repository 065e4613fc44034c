"""What to do at the machine about a named effect."""

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.diagnosis import NamedEffect
from robocal.robots.robot import Robot

_SPRINGS = ("joint_compliance", "link_bending", "base_compliance")
"""Effects whose one coefficient is a spring's, where the masses are stated."""
_NEGATIVE = 3.0
"""Standard uncertainties below zero from which a stiffness is negative; [1]"""
_LOOK_FOR_IT = (
    "look for what changes with it, at the robot, the tool and the station; the model follows it "
    "only roughly"
)
"""Where the cause has no name."""
_MAKE_SURE = "nothing yet: noise alone is the likelier; measure the poses asked for, then decide"
_NO_SPRING = (
    "no spring is negative: check the direction of gravity in campaign.yaml, how the robot is "
    "mounted, its masses in robot.yaml and the sign of payload_kg; or the controller compensates "
    "more than there is"
)
_TOO_MUCH_PAYLOAD = (
    "the stiffness is negative: the controller compensates more than there is; check the payload "
    "stated there"
)


def advice_on(named: NamedEffect, robot: Robot) -> str:
    """One sentence without its full stop."""
    negative = negative_stiffness(named, robot)
    if negative is not None:
        return negative
    if named.goes_with is not None:
        return _LOOK_FOR_IT
    naming, own = named.naming, named.fitted.instance
    likeliest = max(naming.causes, key=lambda cause: cause.probability)
    if naming.none > max(likeliest.probability, naming.unlisted):
        return _MAKE_SURE
    if likeliest.probability > named.probability:
        rival = likeliest.instance
        return f"{rival.title} is the likelier here: {EFFECTS[rival.effect].advice}"
    return EFFECTS[own.effect].advice


def negative_stiffness(named: NamedEffect, robot: Robot) -> str | None:
    """What to check where a stiffness is surely negative; None where it is not."""
    fitted = named.fitted
    effect = fitted.instance.effect
    if effect == "payload_compliance":
        told = _TOO_MUCH_PAYLOAD
    elif effect in _SPRINGS and robot.masses is not None:
        told = _NO_SPRING
    else:
        return None
    return told if fitted.values[0] < -_NEGATIVE * fitted.std[0] else None
