"""Reading a scene file's tables: every key has to be understood, or the scene is refused."""


class Refused(Exception):
    """What Mitsuba cannot express as we mean it, or what this converter does not know."""


def take(table, where, **defaults):
    """The values of the keys in `defaults`, in that order; any other key is refused."""
    unknown = sorted(set(table) - set(defaults))
    if unknown:
        raise Refused(f"`{unknown[0]}` in {where}")
    return [table.get(key, default) for key, default in defaults.items()]


def one_of(table, where, kinds):
    """The one key of `table` among `kinds`, and its value."""
    found = [kind for kind in kinds if kind in table]
    if len(found) != 1:
        raise Refused(f"{where} with {found or list(table)}: expected one of {', '.join(kinds)}")
    return found[0], table[found[0]]


def color(value):
    """Three channels, from a number or three."""
    return [float(value)] * 3 if isinstance(value, (int, float)) else [float(x) for x in value]


def rgb(value):
    """Mitsuba's constant colour."""
    return {"type": "rgb", "value": color(value)}
