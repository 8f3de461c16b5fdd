"""Random NC programs of RS274NGC, for comparing the reader with LinuxCNC's interpreter. Each is made of valid lines by far the most."""

from __future__ import annotations

import numpy as np

Rng = np.random.Generator


def number(rng: Rng, low: float, high: float) -> str:
    return f"{rng.uniform(low, high):.{rng.integers(1, 5)}f}"


def some_axes(rng: Rng, scale: float = 20.0, letters: str = "XYZ") -> str:
    chosen = [a for a in letters if rng.random() < 0.5] or [letters[0]]
    return " ".join(a + number(rng, -scale, scale) for a in chosen)


def pick(rng: Rng, *choices: str) -> str:
    return choices[rng.integers(len(choices))]


def cycles(rng: Rng) -> str:
    """Canned cycles in all planes, with all words, sticky ones left out at random, in series that other codes interrupt."""
    lines = ["G21 G0 X1 Y2 Z10", "F120 S100 M3"]
    absolute, spindle, last, plane = True, 3, "", "Z"
    # (G88 is left out: its retract is the operator's, and the plan has a rapid for it)
    codes = ["G73", "G74", "G81", "G82", "G83", "G84", "G85", "G86", "G87", "G89"]

    def hole(code: str, fresh: bool) -> str:
        def word(letter: str, text: str, keep: float = 0.6) -> str:
            return f" {letter}{text}" if fresh or rng.random() < keep else ""

        depth = number(rng, -9, -1)
        text = " ".join(a + number(rng, -20, 20) for a in "XYZ" if a != plane and rng.random() < 0.7)
        text = text or ("X" if plane != "X" else "Y") + "3"
        text += word(plane, depth) + word("R", number(rng, 0, 3) if not absolute else number(rng, 0, 14))
        if code in ("G73", "G83"):
            text += word("Q", number(rng, 0.7, 4))
        if code in ("G82", "G86", "G89"):
            text += word("P", number(rng, 0.1, 2))
        if code in ("G74", "G84") and rng.random() < 0.4:
            text += " P" + number(rng, 0.1, 2)
        if code == "G87":
            text += "".join(word(letter, number(rng, -3, 3)) for letter in "IJK")
        if code != "G74" and rng.random() < 0.3:
            text += f" L{rng.integers(1, 5)}"
        return text

    for _ in range(rng.integers(4, 20)):
        choice = rng.integers(14)
        if choice < 6:
            code = last if last and rng.random() < 0.5 else codes[rng.integers(len(codes))]
            if plane != "Z" and code in (
                "G74",
                "G84",
            ):  # in G18 and G19 LinuxCNC 2.9 taps elsewhere than at the hole
                code = "G81"
            turning = {"G74": 4, "G84": 3}.get(code, spindle)
            if turning != spindle:
                lines.append(f"M{turning}")
                spindle = turning
            lines.append(
                (code if code != last or rng.random() < 0.5 else "") + " " + hole(code, code != last)
            )
            last = code
        elif choice == 6:
            lines.append(pick(rng, "G98", "G99"))
        elif choice == 7:
            absolute = bool(rng.integers(2))
            lines.append("G90" if absolute else "G91")
            last = ""
        elif choice == 8:
            plane = pick(rng, "Z", "Z", "Y", "X")
            # the plane's normal is left high, so that R is below it
            lines += [{"Z": "G17", "Y": "G18", "X": "G19"}[plane], f"G90 G0 {plane}{number(rng, 5, 15)}"]
            lines.append("G90" if absolute else "G91")
            last = ""
        elif choice == 9:
            lines.append(f"G{rng.integers(2)} {some_axes(rng)} F{number(rng, 50, 900)}")
            last = ""
        elif choice == 10:
            lines += ["G80", ""]
            last = ""
        elif choice == 11:
            lines.append(
                pick(rng, "G28", "G4 P1", "G92 Z5", "G92.1", "G55", "G54", "F300", "G28.1", "G30 Z3")
            )
        elif choice == 12:
            lines.append(pick(rng, "G20", "G21"))
            last = ""
        else:
            lines.append(f"G10 L2 P1 R{number(rng, -180, 180)} {some_axes(rng, 5)}")
    return "\n".join(line for line in lines if line) + "\nM2\n"


def offsets(rng: Rng) -> str:
    """Offsets of every kind, rotated systems, in lines and arcs."""
    lines = ["G21 G0 X1 Y2 Z3", "F120"]
    rotated = rng.random() < 0.6
    absolute = True

    def turn() -> str:
        return f" R{number(rng, -200, 200)}" if rotated and rng.random() < 0.6 else ""

    for _ in range(rng.integers(5, 25)):
        choice = rng.integers(17)
        if choice <= 3:
            lines.append(f"G{rng.integers(2)} {some_axes(rng)}")
        elif choice == 4:
            # (turning the system in force under a G92 offset moves the start of LinuxCNC's next move)
            lines.append(
                ("G92.1\n" if rotated else "") + f"G10 L2 P{rng.integers(0, 10)} {some_axes(rng)}{turn()}"
            )
        elif choice == 5:
            lines.append(f"G10 L20 P{rng.integers(0, 10)} {some_axes(rng)}")
        elif choice == 6:
            lines.append("G52 " + some_axes(rng))
        elif choice == 7:
            lines.append(pick(rng, "G92 " + some_axes(rng), "G92.1", "G92.2", "G92.3"))
        elif choice == 8:
            lines.append(pick(rng, "G28.1", "G30.1", "G28.1 G0 " + some_axes(rng)))
        elif choice == 9:
            lines.append(pick(rng, "G28", "G30") + (" " + some_axes(rng) if rng.random() < 0.7 else ""))
        elif choice == 10:
            lines.append(pick(rng, "G54", "G55", "G58", "G59", "G59.1", "G59.2", "G59.3"))
        elif (
            choice == 11
        ):  # (under a rotation LinuxCNC's G43.1 X moves the next move's start, and its G53 Z moves x and y)
            lines.append(pick(rng, "G43.1 " + some_axes(rng, letters="Z" if rotated else "XZY"), "G49"))
        elif choice == 12:
            absolute = bool(rng.integers(2))
            lines.append("G90" if absolute else "G91")
        elif choice == 13:
            lines.append(f"G90 G53 G{rng.integers(2)} {some_axes(rng)}\nG{90 if absolute else 91}")
        else:
            u, v = [(5.0, 5.0), (5.0, -5.0), (10.0, 0.0)][rng.integers(3)]
            plane = 0 if rotated else rng.integers(3)
            a, b = ("XY", "ZX", "YZ")[plane]
            i = ("I", "K", "J")[plane]
            lines.append(
                f"G91 G{17 + plane} G{rng.integers(2, 4)} {a}{u} {b}{v} {i}5\nG17 G{90 if absolute else 91}"
            )
    return "\n".join(lines) + "\nM2\n"


def feeds(rng: Rng) -> str:
    """Feed modes. S is 1, so that a feed per turn is a feed per minute; threads have feeds of their own."""
    lines = ["G21 G0 X1 Y2 Z3", "S1 M3", "F120"]
    mode = 94
    for _ in range(rng.integers(5, 25)):
        if rng.random() < 0.25:
            mode = int(rng.integers(93, 96))
            lines.append(f"G{mode}" + (f" F{number(rng, 1, 200)}" if mode != 93 else ""))
        f = f" F{number(rng, 0.1, 9)}" if mode == 93 or rng.random() < 0.3 else ""
        choice = rng.integers(5)
        if choice == 0:
            u, v = [(5.0, 5.0), (5.0, -5.0), (10.0, 0.0)][rng.integers(3)]
            lines.append(
                f"G91 G{rng.integers(2, 4)} X{u} Y{v} I5{f} Z{number(rng, -3, 3)} P{rng.integers(1, 3)}\nG90"
            )
        elif choice == 1:
            lines.append(f"G0 {some_axes(rng)}")
        elif choice == 2:
            lines.append(f"{pick(rng, 'G20', 'G21')} G1 {some_axes(rng)}{f}")
        else:
            lines.append(f"G1 {some_axes(rng)}{f}")
    return "\n".join(lines) + "\nM2\n"


def lathe(rng: Rng) -> str:
    """Diameters, threads and tapping, G76 with all words."""
    lines = ["G21 G18 S60 M3", "G0 X40 Z10", "F120"]
    for _ in range(rng.integers(4, 14)):
        choice = rng.integers(9)
        if choice <= 1:
            lines.append(f"G{rng.integers(2)} {some_axes(rng, 30, 'XZ')}")
        elif choice == 2:
            lines.append(
                pick(rng, "G7", "G8", "G90", "G91", "G91 G0 X3\nG90", "G92 X20", "G52 X3 Z1", "G92.1")
            )
        elif choice == 3:
            lines.append(f"G33 {some_axes(rng, 30, 'ZX')} K{number(rng, 0.5, 3)}")
        elif choice == 4:
            lines.append(f"G33.1 {some_axes(rng, 30, 'ZX')} K{number(rng, 0.5, 3)}")
        elif choice <= 6:
            sign = pick(rng, "-", "")
            text = f"G76 P{number(rng, 0.5, 3)} Z{number(rng, -40, 9)} I{sign}{number(rng, 0.1, 3)}"
            text += f" J{number(rng, 0.2, 0.6)} K{number(rng, 0.7, 2)}"
            text += f" R{number(rng, 0.5, 2.5)}" if rng.random() < 0.5 else ""
            text += f" Q{number(rng, 0, 40)}" if rng.random() < 0.5 else ""
            text += f" H{rng.integers(0, 3)}" if rng.random() < 0.5 else ""
            text += f" E{number(rng, 0.2, 3)} L{rng.integers(0, 4)}" if rng.random() < 0.5 else ""
            text += f" X{number(rng, 10, 50)}" if rng.random() < 0.3 else ""
            lines.append(text)
        elif choice == 7:
            lines.append(f"G91 G{rng.integers(2, 4)} X0 Z10 K5\nG90")
        else:
            lines.append(f"G{rng.integers(2, 4)} {some_axes(rng, 30, 'XZ')} R{number(rng, 80, 150)}")
    return "\n".join(lines) + "\nM2\n"


def compensated(rng: Rng) -> str:
    """Cutter radius compensation on both sides, in G17 and G18, around lines and arcs; some tools do not fit, some paths gouge."""
    plane = rng.integers(2)
    a, b = ("XY", "ZX")[plane]
    i, j = ("IJ", "KI")[plane]
    c = "ZY"[plane]
    diameter = rng.uniform(0.5, 4.0)
    lines = [f"G21 G{17 + plane} G0 X0 Y0 Z0", "F120"]
    if plane == 0 and rng.random() < 0.3:
        lines.append(f"G10 L2 P1 R{number(rng, -180, 180)}")
    lines.append(f"G{rng.integers(41, 43)}.1 D{diameter:.3f}")
    lines.append(f"G{rng.integers(2)} {a}{number(rng, 10, 20)} {b}{number(rng, -10, 10)} ")
    heading = rng.uniform(0, 2 * np.pi)
    for _ in range(rng.integers(2, 14)):
        choice = rng.integers(12)
        heading += rng.normal(0.0, 0.9) if rng.random() < 0.7 else 0.0
        if choice < 6:
            size = rng.uniform(2, 15)
            code = (
                ""
                if rng.random() < 0.2 and lines[-1].startswith("G91 G1")
                else f"G{0 if rng.random() < 0.1 else 1} "
            )
            z = f" {c}{number(rng, -1, 1)}" if rng.random() < 0.2 else ""
            f = f" F{number(rng, 50, 200)}" if rng.random() < 0.2 else ""
            lines.append(
                f"G91 {code or 'G1 '}{a}{size * np.cos(heading):.4f} {b}{size * np.sin(heading):.4f}{z}{f}"
            )
        elif choice < 9:
            size, sweep = (
                rng.uniform(1.5, 9),
                rng.uniform(0.2, 5.5) if rng.random() < 0.3 else rng.uniform(0.2, 2),
            )
            turning = rng.choice([-1, 1])
            centre = size * np.array([-np.sin(heading), np.cos(heading)]) * turning
            spoke = complex(*-centre) * np.exp(1j * turning * sweep)
            end = complex(*centre) + spoke
            heading += turning * sweep
            lines.append(
                f"G91 G{3 if turning > 0 else 2} {a}{end.real:.12f} {b}{end.imag:.12f} {i}{centre[0]:.12f} {j}{centre[1]:.12f}"
                + (f" {c}{number(rng, -1, 1)}" if rng.random() < 0.2 else "")
            )
        elif (
            choice == 9 and lines[-1] != "M0"
        ):  # (there LinuxCNC meets the next arc as if the move were one along the last)
            lines.append(f"G90 G1 {c}{number(rng, -3, 3)}")
        elif choice == 10:
            lines.append(pick(rng, "M3", "G4 P0.5", "S300", "M0", "F200"))
        elif rng.random() < 0.3:
            lines += ["G40", f"G91 G{rng.integers(2)} {a}{number(rng, -30, 30)} {b}20"]
            lines += [
                f"G{rng.integers(41, 43)}.1 D{diameter / 2:.3f}",
                f"G91 G1 {a}{number(rng, 5, 10)} {b}-3",
            ]
    lines += ["G40 G90", f"G0 {a}{number(rng, -30, 30)}"]
    return "\n".join(lines) + "\nM2\n"


def polar(rng: Rng) -> str:
    """Polar coordinates in lines, arcs and cycles, absolute and as steps, in moved and rotated systems."""
    lines = ["G21 G0 X3 Y4 Z5", "F120 G99"]
    absolute = True

    def place() -> str:
        both = f"@{number(rng, 1, 20) if absolute else number(rng, 0.1, 3)} ^{number(rng, -400, 400)}"
        return pick(rng, both, both.split()[0], both.split()[1], " ".join(reversed(both.split())))

    for _ in range(rng.integers(5, 20)):
        choice = rng.integers(12)
        if choice <= 4:
            height = f" Z{number(rng, -2, 2)}" if rng.random() < 0.3 else ""
            lines.append(f"G{rng.integers(2)} {place()}{height}")
        elif choice == 5:
            lines.append(f"G{rng.integers(2, 4)} {place()} R{number(rng, 60, 90)}")
        elif choice == 6 and absolute:
            lines.append(f"G81 {place()} Z-3 R2\n{place()}\n{place()}\nG80")
        elif choice == 7:
            lines.append(pick(rng, "G92 X5 Y3", "G92.1", "G52 X1 Y2", "G10 L2 P1 X3 Y1"))
        elif choice == 8:
            lines.append(f"G92.1\nG10 L2 P1 X2 Y5 R{number(rng, -180, 180)}")
        elif choice == 9:
            lines.append("#1=[3+2]\nG0 @#1 ^[#1*7]" if absolute else f"G0 {some_axes(rng, letters='XY')}")
        else:
            absolute = not absolute
            lines.append("G90" if absolute else "G91")
    return "\n".join(lines) + "\nM2\n"


KINDS = {
    "polar": polar,
    "compensated": compensated,
    "cycles": cycles,
    "offsets": offsets,
    "feeds": feeds,
    "lathe": lathe,
}
