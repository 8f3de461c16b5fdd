"""M codes and cycles of conversational programs that move nothing, and why others are refused.

Source: HEIDENHAIN TNC 640 (34059x), conversational programming, M functions of path behaviour and of rotary axes.
"""

AT_END = (2, 30)  # M codes that end the program
# How radius compensation treats corners and arcs, where there is some; and rotary axes, where they are planned.
OF_COMPENSATION, OF_ROTARY = (97, 98, 109, 110), (94, 114, 115, 116, 138, 144)
# They move nothing and last nothing: constant speed at corners in lag operation (90), lag and servo gain (105
# 106), messages about replacement tools (107 108), the end of what is refused below (102 111 113 117 127 129
# 145), look-ahead of radius compensation (120; gouges are refused), the touch probe's monitoring (141),
# modal information (142), what happens at an NC stop (148 149), messages of limit switches (150).
NOTHING = frozenset((90, 102, 105, 106, 107, 108, 111, 113, 117, 120, 127, 129, 141, 142, 145, 148, 149, 150))
OWN_LAST, OF_PATHS = 9, 89  # codes between them belong to the machine's builder, but for 13, 14, 19 and 30
ORIENTATION = 19  # of the spindle
REFUSED = {
    92: "its coordinates refer to a point of the machine (write M91 with machine coordinates)",
    94: "it turns rotary axes by whole turns",
    **dict.fromkeys((97, 98), "it changes the corners of contours"),
    101: "it changes tools by itself",
    **dict.fromkeys((103, 109, 110, 116), "it changes feeds"),
    104: "it brings an older datum back",
    112: "it puts arcs between lines",
    **dict.fromkeys((114, 115, 138, 144), "it changes how the axes move"),
    128: "it keeps the tool's tip where it is while rotary axes turn, which needs a table [kinematics] in the machine file",
    118: "a handwheel moves the axes, too",
    124: "it leaves points out",
    130: "its coordinates are not those of the tilted plane",
    140: "it retracts the tool by MB, which is missing",
    143: "it changes the datum",
}
# Cycles that move nothing, with the sentence that is said of them, and why others are refused.
SAID_CYCLES = {13: "spindle position", 247: "preset"}
_CONTOURS = "it mills a contour of subprograms by paths that only the control knows"
_MEASURES = "it measures: only the machine knows where it ends"
REFUSED_CYCLES = {
    **dict.fromkeys((2, 17, 18), "it taps by the data of older controls; write cycle 206 or 207"),
    **dict.fromkeys((3, 4, 5, *range(210, 216)), "it mills by older data; write cycle 251, 252 or 253"),
    **dict.fromkeys((6, 14, 15, 16, *range(20, 26), 27, 28, 29, 39, *range(270, 277)), _CONTOURS),
    **dict.fromkeys(
        (30, 225, *range(230, 237), 256, 257, 258, *range(262, 268), 285, 286, 287),
        "it mills by paths that only the control knows",
    ),
    **dict.fromkeys(
        (204, 241), "it bores or drills with spindle and coolant that the control switches on the way"
    ),
    **dict.fromkeys((0, 238, 239, *range(400, 500)), _MEASURES),
    **dict.fromkeys((290, 291, 292, *range(800, 900)), "it turns: contours of the part are the control's"),
}
