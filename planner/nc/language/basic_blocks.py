"""Basic blocks of Python source: lines that run one after the other, and which block is next."""

from __future__ import annotations

from dataclasses import dataclass, field

from planner.nc.language.tree import SourcePlace


@dataclass
class _End:
    """How a basic block goes on: to `label`, or to `otherwise` if the condition does not hold; None leaves the function.
    With `computed` it goes to the label of the program whose number that text gives.
    """

    place: SourcePlace
    label: int | None
    condition: str = ""
    otherwise: int = 0
    computed: str = ""


@dataclass
class _Block:
    lines: list[tuple[str, SourcePlace]] = field(default_factory=list)
    end: _End | None = None


class BasicBlocks:
    """The basic blocks of one function, while they are written.

    place    : of what the source stands for, where a line has no place of its own
    block_of : label to block
    numbers  : labels of the program in their order: number, label
    """

    def __init__(self, place: SourcePlace) -> None:
        self.place = place
        self.blocks = [_Block()]
        self.block_of: dict[int, int] = {}
        self.labels = 0
        self.numbers: list[tuple[int, int]] = []

    def put(self, text: str, place: SourcePlace) -> None:
        """Add a line to the block that is being written."""
        self.blocks[-1].lines.append((text, place))

    def label(self) -> int:
        """A new label, whose place is said by `here`."""
        self.labels += 1
        return self.labels

    def here(self, label: int) -> None:
        """The label is the place that is reached now."""
        if self.blocks[-1].lines or self.blocks[-1].end:
            self.blocks.append(_Block())
        self.block_of[label] = len(self.blocks) - 1

    def go(self, place: SourcePlace, label: int, condition: str = "", otherwise: int = 0) -> None:
        """End the block: go on at the label, or at `otherwise` if the condition does not hold."""
        self._leave(_End(place, label, condition, otherwise))

    def jump(self, number: str, place: SourcePlace) -> None:
        """Go to the label of the program whose number that text gives."""
        self._leave(_End(place, None, computed=number))

    def leave(self, place: SourcePlace) -> None:
        """Leave the function."""
        self._leave(_End(place, None))

    def _leave(self, end: _End) -> None:
        self.blocks[-1].end = end
        self.blocks.append(_Block())

    def source(self) -> list[tuple[str, SourcePlace]]:
        """Lines of Python with their places; the last block leaves the function."""
        self.blocks[-1].end = _End(self.place, None)
        if len(self.blocks) == 1:
            return [(" " + text, at) for text, at in self.blocks[0].lines]
        lines = [(" while True:", self.place)]
        self._choose(0, len(self.blocks), "  ", lines)
        return lines

    def _choose(self, low: int, high: int, indent: str, lines: list[tuple[str, SourcePlace]]) -> None:
        """Add the source that finds block `pc` among the blocks `low` to `high` - 1 by halving."""
        if high - low > 1:
            middle = (low + high) // 2
            lines.append((f"{indent}if pc<{middle}:", self.place))
            self._choose(low, middle, indent + " ", lines)
            lines.append((f"{indent}else:", self.place))
            self._choose(middle, high, indent + " ", lines)
            return
        block = self.blocks[low]
        lines.extend((indent + text, place) for text, place in block.lines)
        end = block.end
        if end is None:
            lines.append((f"{indent}pc={low + 1}", self.place))
        elif end.computed:
            table = {number: self.block_of[label] for number, label in reversed(self.numbers)}
            lines.append((f"{indent}pc=run.label({table!r},{end.computed})", end.place))
        elif end.label is not None:
            to = self.block_of[end.label]
            if end.condition:
                lines.append(
                    (f"{indent}pc={to} if {end.condition} else {self.block_of[end.otherwise]}", end.place)
                )
            else:
                lines.append((f"{indent}pc={to}", end.place))
        elif not block.lines:
            lines.append((f"{indent}pass", self.place))
