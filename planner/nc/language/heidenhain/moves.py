"""Path functions as rows of words: L, C, CR, CT, LP, CP. (Roundings and chamfers: `corner_moves`.)

The position, the pole and the normal of its plane, and the last polar coordinates are variables of the
running program, since coordinates may be computed and incremental. Rows carry absolute coordinates. PA counts
from +X, +Y or +Z to the other axis of the pole's plane; arcs about it lie in that plane, DR+ as G3 in G17,
G19 and G18 (TNC 640, conversational programming, polar coordinates).
"""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from planner.nc.arcs import IN_PLANE
from planner.nc.language import makers, swivel, tree
from planner.nc.language.heidenhain import text
from planner.nc.language.making import assumed_row

Words = list[tuple[str, tree.Expression]]
Ends = dict[str, tree.Expression]  # absolute coordinates by axis
_AXES = "XYZ"
_WORKING = 2  # normal of the working plane: the tool axis is Z
_PLANE_CODES = {0: 19.0, 1: 18.0}
OUT_OF_PLANE = "out of the pole's plane, or in it beside polar coordinates, belongs to no such move"
_FAST_ARC = "an arc at rapid (FMAX) is not read; write its F"
_EXTRA = re.compile(r"\s*\b(LEN|CCA)\s*(?=[-+.\dQ])", re.IGNORECASE)
COMPENSATES = re.compile(r"\bR[LR]\b|\bAPPR\b|\bDEP\b", re.IGNORECASE)
TITLES = (7, 8, 10, 11, 26)  # cycles of the frame
# Functions that set a part of the frame as a cycle does, with what ends it; and tilted planes with their angles.
TRANSFORMED = {"TRANS MIRROR": (8, ""), "TRANS ROTATION": (10, "ROT"), "TRANS SCALE": (11, "SCL")}
PLANES = {
    "PLANE SPATIAL": ("SPA", "SPB", "SPC"),
    "PLANE EULER": ("EULPR", "EULNU", "EULROT"),
    "PLANE RELATIV": ("SPA", "SPB", "SPC"),
    "PLANE RELATIVE": ("SPA", "SPB", "SPC"),
    "PLANE RESET": (),
}
_ANGLE = r"\s*(SP[ABC]|EUL(?:PR|NU|ROT))\s*(?=[-+.\dQ])"


class Moves:
    """Makes the rows of the path functions of one program."""

    def __init__(self, feed_scale: float):
        # what F is multiplied with: 1, or 0.1 in inch programs, where F is in tenths of an inch per minute
        self.feed_scale = feed_scale
        self.tilted = False  # there may be poles in other planes than X/Y
        self.automatic: tree.Expression | None = None  # F of the tool call

    def feed_words(self, block: text.Block, given: text.Items) -> Words:
        """The F word, if there is one. Raises ProgramFault for F AUTO without a feed in the tool call."""
        feed = given.feed
        if given.automatic:
            feed = self.automatic
            if feed is None:
                raise block.fault("F AUTO, and the tool call before has no F")
        return [] if feed is None else [("F", self.scaled(feed))]

    def scaled(self, feed: tree.Expression) -> tree.Expression:
        """A feed in mm or inch per minute."""
        return feed if self.feed_scale == 1.0 else feed * self.feed_scale

    def straight(self, block: text.Block, given: text.Items, ends: Ends, machine: bool = False) -> text.Rows:
        """L and LP: a straight move to absolute coordinates."""
        feed = self.feed_words(block, given)
        if not ends:
            return [tree.row(block.place, *feed)] if feed else []
        codes: Words = [("G", tree.Number(53.0))] if machine else []
        codes.append(("G", tree.ZERO if given.fast else tree.ONE))
        return [tree.row(block.place, *codes, *feed, *ends.items(), assigned=_assigned(ends))]

    def by_plane(self, block: text.Block, rows: Callable[[int], text.Rows | None]) -> text.Rows:
        """The block's rows by the normal of the pole's plane, None for no such plane. Raises ProgramFault."""
        found = rows(_WORKING)
        if not self.tilted:
            if found is None:
                raise block.fault(f"a coordinate that lies {OUT_OF_PLANE}")
            return found
        none: text.Rows = [tree.made(block.place, makers.refuse(f"a coordinate that lies {OUT_OF_PLANE}"))]
        branches = tuple((tree.op("EQ", text.PLANE, normal), rows(normal) or none) for normal in (0, 1))
        return [tree.If(block.place, branches, found or none)]

    def circle(self, block: text.Block, given: text.Items, ends: Ends) -> text.Rows:
        """C: an arc about the pole, in its plane."""
        arc = partial(self._arc, block, given, ends, _arc_code(block, given))
        return self.by_plane(block, lambda normal: None if _AXES[normal] in ends else arc(normal))

    def _arc(
        self,
        block: text.Block,
        given: text.Items,
        ends: Ends,
        code: tree.Expression,
        normal: int,
        turns: tree.Expression | None = None,
    ) -> text.Rows:
        """An arc about the pole."""
        block.require(not given.fast, _FAST_ARC)
        words: Words = [("G", code), *self.feed_words(block, given), *ends.items()]
        words += [("IJK"[a], text.POLE[a] - text.POSITION[_AXES[a]]) for a in IN_PLANE[normal]]
        if turns is not None:
            words.append(("P", turns))
        arc = tree.row(block.place, *words, assigned=_assigned(ends))
        if normal == _WORKING:
            return [arc]
        plane, back = (tree.row(block.place, ("G", g)) for g in (_PLANE_CODES[normal], 17.0))
        return [plane, arc, back]

    def radius_arc(self, block: text.Block, given: text.Items, ends: Ends) -> text.Rows:
        """CR: an arc of a given radius."""
        if given.radius is None or not given.turn:
            raise block.fault("CR needs R and its direction, DR+ or DR-")
        block.require(not given.fast, _FAST_ARC)
        words = [("G", _arc_code(block, given)), *self.feed_words(block, given), *ends.items()]
        words.append(("R", given.radius))
        return [tree.row(block.place, *words, assigned=_assigned(ends))]

    def tangent_arc(self, block: text.Block, given: text.Items, ends: Ends) -> text.Rows:
        """CT: the arc that goes on in the direction of the last move."""
        block.require(not given.fast, _FAST_ARC)
        arc = tree.made(block.place, makers.tangent_arc, **ends, **dict(self.feed_words(block, given)))
        return [arc, tree.assign(block.place, *_assigned(ends))]

    def polar(self, block: text.Block, given: text.Items) -> text.Rows:
        """The statement that finds the polar coordinates of LP and CTP."""
        names = dict(zip(("PR", "PA"), text.POLAR, strict=True))
        change = {one: one + given.polar["I" + c] for c, one in names.items() if "I" + c in given.polar}
        change |= {one: given.polar[c] for c, one in names.items() if c in given.polar}
        in_order = ((one, change[one]) for one in text.POLAR if one in change)
        return [tree.assign(block.place, *in_order)] if change else []

    def polar_ends(self, block: text.Block, given: text.Items, normal: int = _WORKING) -> Ends | None:
        """Coordinates of polar ones, and along the normal; None for a block with one in the plane."""
        radius, angle = text.POLAR
        if set(given.axes) & {"X", "Y", "Z"} - {_AXES[normal]}:
            return None
        first, second = IN_PLANE[normal]
        ends: Ends = {
            _AXES[first]: text.POLE[first] + radius * tree.op("COS", angle),
            _AXES[second]: text.POLE[second] + radius * tree.op("SIN", angle),
        }
        ends |= {axis: text.absolute(axis, end) for axis, end in given.axes.items() if axis == _AXES[normal]}
        return dict(sorted(ends.items()))

    def to_polar(self, block: text.Block, given: text.Items) -> text.Rows:
        """LP and CTP: L and, in the working plane, CT to polar coordinates."""
        straight = block.function == "LP"
        move = self.straight if straight else self.tangent_arc

        def rows(normal: int) -> text.Rows | None:
            ends = self.polar_ends(block, given, normal) if straight or normal == _WORKING else None
            return None if ends is None else move(block, given, ends)

        return [*self.polar(block, given), *self.by_plane(block, rows)]

    def polar_arc(self, block: text.Block, given: text.Items) -> text.Rows:
        """CP: an arc or a helix about the pole to a polar angle, or by an angle of any number of turns."""
        code, by = _arc_code(block, given), given.polar.get("IPA")
        if isinstance(by, tree.Number) and by.value * given.turn < 0.0:
            raise block.fault("IPA and DR of CP have the same sign")
        if by is None and "PA" not in given.polar:
            raise block.fault("CP needs PA or IPA")
        radius, angle = text.POLAR
        turns = None if by is None else tree.op("FUP", tree.op("ABS", by) / 360 - 1e-9)

        def rows(normal: int) -> text.Rows | None:
            first, second = (text.POSITION[_AXES[a]] - text.POLE[a] for a in IN_PLANE[normal])
            to = given.polar["PA"] if by is None else tree.op("ATAN", second, first) + by
            before = tree.assign(block.place, (radius, tree.op("LEN", first, second)), (angle, to))
            ends = self.polar_ends(block, given, normal)
            if ends is None:
                return None
            return [before, *self._arc(block, given, ends, code, normal, turns)]

        return self.by_plane(block, rows)


def _arc_code(block: text.Block, given: text.Items) -> tree.Expression:
    """G3 or G2. Raises ProgramFault without a direction."""
    block.require(given.turn, "an arc needs its direction: DR+ or DR-")
    return tree.Number(3.0 if given.turn > 0 else 2.0)


def _assigned(ends: Ends) -> tree.Assignments:
    return tuple((text.POSITION[axis], end) for axis, end in ends.items() if axis in text.POSITION)


def approach_rows(block: text.Block, moves: Moves) -> tuple[text.Rows, text.Items]:
    """APPR or DEP, with its M codes among the items. Raises ProgramFault."""
    departs, column = block.function == "DEP", block.column
    kind = block.take(r"\s*(P?)(LT|LN|CT|LCT)\b")
    if kind is None:
        raise block.wrong(f"{block.function} is followed by LT, LN, CT or LCT")
    given: dict[str, tree.Expression] = {}
    rest = block.text
    for extra in _EXTRA.finditer(block.text, kind.end()):
        block.column = extra.end()
        given[extra.group(1).upper()] = block.value()
        rest = rest[: extra.start()] + " " * (block.column - extra.start()) + rest[block.column :]
    found = text.items(replace(block, text=rest, column=kind.end()))
    ends = {axis: text.absolute(axis, number) for axis, number in found.axes.items()}
    before: text.Rows = []
    if kind[1]:  # PLT and the others: polar coordinates
        before, by_pole = moves.polar(block, found), moves.polar_ends(block, found)
        if by_pole is None:
            raise block.fault("polar coordinates stand instead of X and Y", column)
        ends = by_pole
    if (found.polar and not kind[1]) or found.turn or found.fast:
        raise block.fault("APPR and DEP take X Y Z, LEN, R, CCA, RL or RR, and F", column)
    fed = moves.automatic if found.automatic else found.feed
    given |= ends | {c: value for c, value in (("R", found.radius), ("F", fed)) if value is not None}
    if departs:
        if found.side:
            raise block.fault("DEP switches radius compensation off; RL and RR do not belong to it", column)
        made = partial(makers.depart, kind=kind[2].upper())
        return [*before, tree.made(block.place, made, **given), text.looked_up(block)], found
    made = partial(makers.approach, kind=kind[2].upper(), side=found.side or 0)
    approach = tree.made(block.place, made, **given)
    return [*before, approach, tree.assign(block.place, *_assigned(ends))], found


def frame_rows(block: text.Block, given: Ends, cycle: int) -> text.Rows:
    """A part of the frame; the position is asked for behind it, since it has other coordinates then."""
    frame = tree.made(block.place, partial(makers.heidenhain_frame, cycle=cycle), **given)
    return [frame, text.looked_up(block)]


def datum_rows(block: text.Block) -> text.Rows:
    """TRANS DATUM AXIS X Y Z, TRANS MIRROR AXIS X, TRANS ROTATION ROT, TRANS SCALE SCL, and RESET of each.
    Raises ProgramFault."""
    if block.function in TRANSFORMED:
        cycle, none = TRANSFORMED[block.function]
        if block.take(r"\s*RESET\b"):
            return frame_rows(block, {none: tree.ONE if none == "SCL" else tree.ZERO} if none else {}, cycle)
        block.take(r"\s*AXIS\b")
        return transformed(block, cycle)
    match = block.take(r"\s*(AXIS|RESET)\b")
    if match is None:
        raise block.wrong("TRANS DATUM is followed by AXIS and coordinates, or by RESET")
    ends = match[1].upper() == "RESET"
    return frame_rows(block, dict.fromkeys("XYZ", tree.ZERO) if ends else _shifts(block), 7)


def transformed(block: text.Block, cycle: int) -> text.Rows:
    """The line n.1 (or n.2 ...) of a cycle of the frame. Raises ProgramFault."""
    given: Ends
    if cycle == 7:
        given = _shifts(block)
    elif cycle == 8:
        given = dict.fromkeys(block.rest.upper().split(), tree.ZERO)
        if given.keys() - {"X", "Y", "Z"}:
            raise block.wrong("a mirror image takes the axes X, Y and Z, or none to end it")
    elif cycle == 26:
        given = block.named(r"\s*(CC[XYZ]|[XYZ])\s*(?=[-+.\dQ])")
        block.end("cycle 26 takes factors X Y Z and their centre CCX CCY CCZ")
    else:
        column, word = block.column, block.take(r"\s*(I?ROT|SCL)\s*")
        if word is None or (word[1].upper() == "SCL") != (cycle == 11):
            raise block.fault("ROT or IROT of cycle 10, or SCL of cycle 11 is expected here", column)
        given = {word[1].upper(): block.value()}
        block.end()
    return frame_rows(block, given, cycle)


def plane_rows(block: text.Block) -> text.Rows:
    """PLANE SPATIAL, EULER, RELATIV and RESET. Raises ProgramFault."""
    given = block.named(_ANGLE)
    needed = PLANES[block.function]
    if set(given) - set(needed) or (needed and not given):
        raise block.wrong(f"{block.function} takes {', '.join(needed) or 'no angles'}")
    rest = block.rest.upper()
    way = re.search(r"\b(STAY|TURN|MOVE)\b", rest)
    if way is None:
        raise block.wrong("TURN, MOVE or STAY says what the rotary axes do")
    given |= {"way": tree.number(swivel.WAYS[way[1]])}
    if side := re.search(r"\bSEQ\s*([-+])", rest):
        given["side"] = tree.Number(1.0 if side[1] == "+" else -1.0)
    back = re.search(r"\bMB\s*(MAX)?", rest)
    if back and not back[1]:
        raise block.wrong("MB with a length is not read; write L M140 MB before the plane")
    if "RELATIV" in block.function:
        given["relative"] = tree.ONE
    if block.function == "PLANE EULER":
        given |= {name: given.get(name, tree.ZERO) for name in needed}
    return [*(to_the_top(block) if back and way[1] != "STAY" else []), *_tilted(block, given)]


def to_the_top(block: text.Block) -> text.Rows:
    """MB MAX: back along the tool's axis, to machine zero."""
    away = tree.row(block.place, ("G", 53.0), ("G", tree.ZERO), ("Z", tree.ZERO))
    return [assumed_row(block.place, "retraction"), away, text.looked_up(block)]


def working_plane(block: text.Block) -> text.Rows:
    """Cycle 19: A B C as spatial angles; the rotary axes stay."""
    given = {f"SP{axis}": angle for axis, angle in block.named(r"\s*([ABC])\s*(?=[-+.\dQ])").items()}
    return _tilted(block, {**given, "way": tree.number(swivel.WAYS["STAY"])})


def _tilted(block: text.Block, given: dict[str, tree.Expression]) -> text.Rows:
    return [tree.made(block.place, swivel.heidenhain, **given), text.looked_up(block)]


def _shifts(block: text.Block) -> dict[str, tree.Expression]:
    column, given = block.column, text.items(block)
    if not given.axes or given.codes or given.polar or given.feed is not None:
        raise block.fault("a datum shift by X, Y or Z is read, not from a table", column)
    return {"I" * relative + axis: end for axis, (end, relative) in given.axes.items()}
