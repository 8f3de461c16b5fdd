"""Tables of a Sinumerik's codes and commands: what they are in RS274NGC, what moves nothing, what is said of the
others, and why the rest is refused.

Source: SINUMERIK 840D sl, NC programming (12/2019), lists of G functions and of operations.
"""

from planner.nc.settings import TOOL_POINT_OFF, TOOL_POINT_ON

# Letters of words with the same meaning in RS274NGC.
PLAIN_LETTERS = "NGXYZIJKFSMABCUVW"
RETURNS = (2, 17, 30)  # M codes that end a subprogram
SAME_CODES = (0, 1, 2, 3, 17, 18, 19, 54, 55, 56, 57, 90, 91, 94)  # G codes with the same meaning
# G codes of Siemens that are others here; an empty tuple changes nothing.
CODES: dict[int, tuple[float, ...]] = {
    **{code: (float(code),) for code in (*SAME_CODES, 4, 33, 93, 95)},
    9: (),  # exact stop of one block; a full stop is added behind it
    **dict.fromkeys((53, 153), (53.0,)),
    60: (61.1,),
    **dict.fromkeys((64, 641, 642, 643, 644, 645), (64.0,)),
    **dict.fromkeys((70, 700), (20.0,)),
    **dict.fromkeys((71, 710), (21.0,)),
    500: (59.3,),  # whose origin is set to 0 before it
    **dict.fromkeys((96, 962), (95.0, 96.0)),  # with the feed per turn
    961: (94.0, 96.0),
    **dict.fromkeys((97, 972, 973), (95.0, 97.0)),
    971: (94.0, 97.0),
    **dict.fromkeys((40, 41, 42, 110, 111, 112, 290, 450, 451, 460, 601, 602, 603, 621, 62, 25, 26, 140), ()),
    **dict.fromkeys(range(505, 600), (54.1,)),
}  # fmt: skip
FEED_MODES = (94, 95, 96, 97, 961, 962, 971, 972, 973)  # that end G93
SYSTEMS_FURTHER = 500  # G505 is the work system 5
# Commands that move nothing and change nothing of what is planned, with or without arguments or a value:
# feedforward, compressors (their tolerance is the program's), how orientations change where that is as
# planned, defaults of approaches, frames and collision checks, displays, spindles and tools, channels.
IDLE = frozenset((
    "FNORM", "FFWON", "FFWOF", "SOFT", "COMPON", "COMPCURV", "COMPCAD", "COMPSURF", "COMPOF", "UPATH",
    "SPATH", "FIFOCTRL", "STARTFIFO", "STOPFIFO", "ORIMKS", "ORIAXES", "ORIMACHAX", "ORISON", "ORISOF",
    "ORIROTA", "ORIEULER", "ORIRPY", "ORIRPY2", "TOFRAMEOF", "PAROTOF", "TOWSTD", "CUT2D", "CUT2DF",
    "CUTCONOF", "CDON", "CDOF", "CDOF2", "NORM", "CFTCP", "RTLION", "SETMS", "WORKPIECE", "MSG",
    "EXTERN", "LIMS", "WALIMON", "WALIMOF", "DISPLON", "DISPLOF", "SBLON", "SBLOF", "SAVE", "ICYCOF",
    "ICYCON", "DELAYFSTON", "DELAYFSTOF", "CPRECON", "CPRECOF", "FENDNORM", "SPCON", "SPCOF", "TANGOF",
    "COUPOF", "PTPOFF", "CP", "PM", "GETSELT", "DEACTPROC", "GROUP_BEGIN", "GROUP_END", "GROUP_ADDEND",
    "CLEARM", "SETM", "LOCK", "UNLOCK", "CANCEL", "TCOABS", "TCOFR", "LFOF", "LFON", "PROTOCOL",
    "INICF", "REDEF", "DYNNORM", "DYNPOS", "DYNROUGH", "DYNSEMIFIN", "DYNFINISH", "DYNPREC",
))  # fmt: skip
# Commands and words that are not followed and may change geometry or time: what is said of them (making.py).
SAID = {
    **dict.fromkeys(("BRISK", "DRIVE"), "acceleration"),
    **dict.fromkeys(("CFC", "CFIN"), "tool centre feed"),
    **dict.fromkeys(("ORIWKS", "ORIVECT", "ORIVIRT1", "ORIPLANE"), "orientation"),
    "RTLIOF": "rapid axes",
    **dict.fromkeys(("SPOS", "SPOSA"), "spindle position"),
    **dict.fromkeys(("WAITM", "WAITMC", "WAITE", "WAITS", "START", "INIT"), "waits"),
}
# Commands that switch the tool centre point on and off, and the M codes of RS274NGC that stand for them.
TOOL_POINT = {"TRAORI": float(TOOL_POINT_ON[1]), "TRAFOOF": float(TOOL_POINT_OFF[1])}
_POST = "let the CAM system write the moves out"
_SPLINE = "it joins the points by a curve", "let the CAM system write lines or arcs"
_COUPLED = "it couples axes", _POST
_TURNED = "a face or mantle of a turned part is milled in coordinates that turn with it", _POST
_DYNAMIC = "it changes limits of axes in percent", "leave it out, and set the machine file's limits"
_POSITIONING = "an axis moves apart from the others", "write the axis into the block itself: X5"
_CORNER_FEED = "it sets the feed of roundings and chamfers", "leave it out: they are cut at F"
_SYNCHRONOUS = "an action beside the program depends on the machine's state", "leave it out"
_CHIPS = "it removes stock by a contour that the control reads", _POST
_MILLS = "it mills by paths that only the control knows", _POST
_TILTED = "it tilts the coordinates", "write CYCLE800 or ROT on a machine with a table [kinematics]"
_SOFT_APPROACH = "it approaches or leaves the contour on an arc or line", "write that move as G1, G2 or G3"
# Commands, words and G codes that are refused: what they would do on the control, and the nearest help.
REFUSED: dict[str, tuple[str, str]] = {
    **dict.fromkeys(("TRANSMIT", "TRACYL", "TRAANG", "TRACON", "TRACOOF"), _TURNED),
    **dict.fromkeys(("ROTS", "AROTS", "CROTS", "TOFRAME", "TOROT", "TOFRAMEX", "TOFRAMEY", "PAROT"), _TILTED),
    **dict.fromkeys(("BSPLINE", "ASPLINE", "CSPLINE", "POLY", "SPLINEPATH", "INVCW", "INVCCW", "PO", "PW", "SD"), _SPLINE),
    **dict.fromkeys(("TRAILON", "TRAILOF", "COUPON", "COUPDEF", "LEADON", "LEADOF", "TANG", "TANGON", "GEOAX", "CTABDEF"), _COUPLED),
    **dict.fromkeys(("ACC", "VELOLIM", "JERKLIM", "OVRA", "FL", "FA", "FXS", "FGREF", "ACCLIMA"), _DYNAMIC),
    **dict.fromkeys(("POS", "POSA", "POSP", "MOV", "WAITP", "OS", "REPOSA", "REPOS"), _POSITIONING),
    **dict.fromkeys(("FRC", "FRCM"), _CORNER_FEED),
    **dict.fromkeys(("WHEN", "WHENEVER", "ID", "IDS", "EVERY", "FROM", "DO", "SYNFCT", "SETINT"), _SYNCHRONOUS),
    **dict.fromkeys((f"CYCLE{n}" for n in (62, 63, 64, 92, 93, 94, 95, 96, 97, 98, 99, 930, 940, 950, 951, 952)), _CHIPS),
    **dict.fromkeys(("CYCLE60", "CYCLE61", "CYCLE70", "CYCLE71", "CYCLE72", "CYCLE73", "CYCLE76", "CYCLE77", "CYCLE78", "CYCLE79",
                     "CYCLE90", "CYCLE899"), _MILLS),
    **dict.fromkeys(("G147", "G148", "G247", "G248", "G347", "G348", "G341", "G340", "DISR", "DISCL", "G141", "G142", "G143",
                     "DISC"), _SOFT_APPROACH),
    **dict.fromkeys(("A3", "B3", "C3", "A4", "B4", "C4", "A5", "B5", "C5", "A2", "B2", "C2", "LEAD", "TILT"), (
        "a direction of the tool, which the control makes angles of",
        "choose a post-processor that writes the angles of the rotary axes (A=, B=, C=)")),
    **dict.fromkeys(("MEAS", "MEAW", "CYCLE976", "CYCLE977", "CYCLE978", "CYCLE979", "CYCLE971", "CYCLE982", "CYCLE961"), (
        "it measures: only the machine knows where it ends", "plan the parts before and after it")),
    "G291": ("the program goes on in the language of Fanuc (ISO mode)", "write the parts into files of their own"),
    "KONT": ("compensation approaches and leaves round the contour's ends", "write NORM"),
    "G451": ("outer corners under compensation are intersections", "write G450"),
    "SETAL": ("the program raises its alarm here", "run the program with values that do not lead there"),
    "DIAM90": ("X is a diameter under G90 and a radius under G91", "write DIAMON or DIAMOF"),
    "OFFN": ("the contour has an allowance", "write the contour with its allowance"),
    "ANG": ("the end of a line is computed from its angle", "write its end with X and Y"),
    "AR": ("an arc is given by its opening angle", "write its centre (I J) or its radius (CR=)"),
    "FGROUP": ("F is the speed of other axes", "leave it out, if these are X, Y, Z"),
    "FLIN": ("the feed changes evenly along the block", "leave it out: F holds for the block"),
    "FCUB": ("the feed changes along the block", "leave it out: F holds for the block"),
    "FPO": ("the feed changes along the block", "leave it out: F holds for the block"),
    "FB": ("the feed of this block alone", "write F in this block, and again in the next"),
    "FZ": ("a feed per tooth", "write F in mm/min"),
    "DEFINE": ("it gives statements another name", "write the statements out"),
    "PCALL": ("a program is called by a path of the control", 'write CALL "NAME", and put the file beside the program'),
    "PUTFTOC": ("it changes tool offsets while the axes move", "leave it out"),
}  # fmt: skip
OF_CONTROL = "a variable that only the control knows is not set; leave it out, or write what it does as words"
UNKNOWN = (
    "there is no such subprogram in this program or its folder, and no such word is known: it may move the machine; put its file "
    "({0}.SPF or {0}.MPF) beside the program; if the machine's builder made it and it moves nothing, name it under [dialect] of "
    'the machine file: subprograms = ["{0}"]'
)


def refusal(name: str) -> str:
    """Why a word is refused, in a sentence: what it would do there, and what helps."""
    what, helps = REFUSED[name]
    return f"{name} is not read: {what}; {helps}"
