"""Disassembled machine code: instructions with the lines that they come from, blocks, loops."""
import collections
import re

INSTRUCTION = re.compile(r"\s+/\*([0-9a-f]{4,})\*/\s+(?:@!?U?P\w+\s+)?([A-Z][\w.]*)\s*([^;]*);")
PLACE = re.compile(r'\s*//## File "[^"]*", line (\d+)( inlined at)?')
LABEL = re.compile(r"^(\.L_x?_?\w+):")
TARGET = re.compile(r"`\(([.\w]+)\)")


class Instruction:
    def __init__(self, address, opcode, operands, is_predicated, lines):
        self.address, self.opcode, self.operands = address, opcode, operands
        self.is_predicated = is_predicated
        self.lines = lines  # innermost first: the line itself, then where each function was inlined
        target = TARGET.search(operands)
        self.target = target.group(1) if target else None

    @property
    def base(self):
        return self.opcode.split(".")[0]


def parse(text):
    """The instructions in order, and the index that each label stands for."""
    instructions, labels, lines, is_new = [], {}, (), True
    for row in text.splitlines():
        place, label, found = PLACE.match(row), LABEL.match(row), INSTRUCTION.match(row)
        if place:
            lines = (int(place.group(1)),) if is_new else lines + (int(place.group(1)),)
            is_new = not place.group(2)
        elif label:
            labels[label.group(1)] = len(instructions)
        elif found:
            instructions.append(Instruction(int(found.group(1), 16), found.group(2), found.group(3),
                                            bool(re.search(r"\*/\s+@", row)), lines))
    return instructions, labels


def successors(instructions, labels):
    """For each instruction the indices of those that may follow it."""
    result, joins = [], {}
    for k, instruction in enumerate(instructions):
        following = [k + 1] if k + 1 < len(instructions) else []
        jumps_to = labels.get(instruction.target)
        if instruction.base == "BSSY":
            joins[instruction.operands.split(",")[0]] = jumps_to
        # The compiler also writes far jumps as calls from which nothing returns.
        if instruction.base in ("BRA", "BRX", "JMP", "CALL") and jumps_to is not None:
            # `BRA.U UP0` and `BRA P0` go on where their operand is false.
            is_conditional = instruction.is_predicated or re.match(r"!?U?P\d|R\d", instruction.operands) or \
                ".U" in instruction.opcode or "DIV" in instruction.opcode
            following = [jumps_to] + (following if is_conditional else [])
        elif instruction.base == "EXIT" and not instruction.is_predicated:
            following = []
        elif instruction.base == "BSYNC" and joins.get(instruction.operands.strip()) is not None:
            following = [joins[instruction.operands.strip()]]
        result.append(following)
    return result


def blocks_of(following):
    """Basic blocks: (first, last + 1), and the blocks that follow each."""
    starts = {0}
    for k, nexts in enumerate(following):
        if nexts != [k + 1]:
            starts.update(nexts)
            starts.add(k + 1)
    starts = sorted(start for start in starts if start < len(following))
    blocks = list(zip(starts, starts[1:] + [len(following)]))
    number = {start: k for k, start in enumerate(starts)}
    return blocks, [[number[place] for place in following[end - 1]] for _, end in blocks]


def dominators(nexts):
    """For each block the set of blocks through which every way to it leads; empty where none leads."""
    count = len(nexts)
    before = collections.defaultdict(set)
    for block, targets in enumerate(nexts):
        for target in targets:
            before[target].add(block)
    reached, stack = set(), [0]
    while stack:
        block = stack.pop()
        if block not in reached:
            reached.add(block)
            stack += nexts[block]
    found = [set(reached) if block else {0} for block in range(count)]
    changes = True
    while changes:
        changes = False
        for block in sorted(reached - {0}):
            known = [found[other] for other in before[block] if other in reached]
            new = set.intersection(*known) | {block}
            if new != found[block]:
                found[block], changes = new, True
    return found, before, reached


class Loop:
    def __init__(self, head, blocks, back_edges):
        self.head, self.blocks, self.back_edges = head, blocks, back_edges


def loops_of(nexts):
    """Natural loops by their heads."""
    found, before, reached = dominators(nexts)
    loops = {}
    for block in reached:
        for head in nexts[block]:
            if head not in found[block]:
                continue
            body, stack = {head}, [block]
            while stack:
                inner = stack.pop()
                if inner not in body:
                    body.add(inner)
                    stack += [other for other in before[inner] if other in reached]
            loop = loops.setdefault(head, Loop(head, set(), []))
            loop.blocks |= body
            loop.back_edges.append(block)
    return sorted(loops.values(), key=lambda loop: -len(loop.blocks)), reached
