#!/usr/bin/env python3
"""What the kernels cost a GPU, counted without one: ./run bench kernels.

Each kernel of `drape_bench kernels --dump` is translated to CUDA (translate.py), compiled for each architecture
(nvrtc.py), and its machine code read (sass.py): registers, spills, shared memory, work groups per multiprocessor, and
instructions of a warp per stage: those of each loop times its rounds (rounds.py). For AMD's chips: registers, spills,
shared memory and waves, by RADV's compiler (amd.py).
"""
import argparse
import json
import math
import os
import re
import sys

import amd
import gpus
import nvrtc
import rounds
import sass
import translate

HERE = os.path.dirname(os.path.abspath(__file__))
LIMITS = os.path.join(HERE, "limits.json")
CHECKED = "sm_90"  # the architecture of limits.json


class Source:
    """Functions and lines of a translated kernel."""

    def __init__(self, cuda):
        self.lines = [""] + cuda.splitlines()
        self.functions, name, depth = [""] * len(self.lines), "", 0
        inside = False
        for k, line in enumerate(self.lines):
            found = re.match(r"(?:GLSL|extern \"C\") .*?(\w+)\s*\(", line)
            if found and depth <= 1:
                name = "kernel" if line.startswith("extern") else found.group(1)
            self.functions[k] = name
            depth += line.count("{") - line.count("}")

        self.loops_around = self._loops()

    def _loops(self):
        """For each line the lines of the loop statements that it is in."""
        around = [set() for _ in self.lines]
        for line, text in enumerate(self.lines):
            if re.match(r"\s*(for \(|while \(|do \{)", text):
                for inside in range(line, self._end(line) + 1):
                    around[inside].add(line)
        return around

    def _end(self, first):
        """The last line of the statement that begins there."""
        rest = "\n".join(self.lines[first:first + 400])
        k = translate.closing(rest, rest.index("("), "()") if not rest.lstrip().startswith("do") else 0
        brace, semicolon = rest.find("{", k), rest.find(";", k)
        inner = re.compile(r"\s*(#pragma unroll 1\s*)?(for|if) \(").match(rest, k + 1)
        if inner:  # for (...) for (...) or for (...) if (...)
            return first + rest[:k + 1].count("\n") + self._lines_of_inner(rest, k + 1)
        end = translate.closing(rest, brace) if 0 <= brace < semicolon or semicolon < 0 else semicolon
        return first + rest[:end].count("\n") + (1 if rest.lstrip().startswith("do") else 0)

    @staticmethod
    def _lines_of_inner(rest, k):
        end = translate.closing(rest, rest.index("(", k), "()")
        brace, semicolon = rest.find("{", end), rest.find(";", end)
        end = translate.closing(rest, brace) if 0 <= brace < semicolon else semicolon
        return rest[k:end].count("\n")

    def depth_of(self, head, instructions):
        """How deep in the calls the loop statement is."""
        return max(len(instruction.lines) - k for instruction in instructions
                   for k, place in enumerate(instruction.lines) if head in self.loops_around[place])

    def chain(self, instruction):
        """The functions that an instruction is in, the outermost first."""
        return [self.functions[line] for line in reversed(instruction.lines)]


# A loop of the machine code belongs to the innermost statement that most of its instructions come from. Not all do:
# the compiler moves some, and joins equal ones.
MOST = 0.8


def is_unrolled(source, line):
    return any(source.functions[line] == function and source.lines[line].strip().startswith(text)
               for function, text in rounds.UNROLLED)


def heads_of(source, instructions, blocks, loops):
    """For each loop the line of its statement. `loops`: outer ones first."""
    heads = {}
    for loop in reversed(loops):  # an inner loop may be nearly all of an outer one, which then gets the next statement
        inside = [instruction for block in loop.blocks for instruction in instructions[slice(*blocks[block])]]
        count_of = {}
        for instruction in inside:
            for line in {head for place in instruction.lines for head in source.loops_around[place]}:
                if not is_unrolled(source, line):
                    count_of[line] = count_of.get(line, 0) + 1
        taken = {heads[other] for other in loops if other in heads and other.blocks < loop.blocks}
        fitting = [line for line, count in count_of.items() if count >= MOST * len(inside) and line not in taken]
        if not fitting and any(source.functions[line] == "RunSubsteps" for line in taken):
            continue  # the outer one of two loops that the compiler made of that statement
        if not fitting:  # few of them stayed where they were
            left = [line for line in count_of if line not in taken]
            most = max((count_of[line] for line in left), default=0)
            fitting = [line for line in left if count_of[line] == most]
        if not fitting and not any("RunSubsteps" in source.chain(instruction) for instruction in inside):
            continue  # a copy of the record that the compiler made a loop: once in a step
        if not fitting:
            address = instructions[blocks[loop.head][0]].address
            raise SystemExit(f"kernels/count.py: no statement for the loop at {address:#x}")
        # Of nested statements the inner one has fewer instructions; of equals, it is deeper in the calls or comes later.
        heads[loop] = min(fitting, key=lambda line: (count_of[line], -source.depth_of(line, inside), -line))
    return heads


def stage_of(chain):
    if "Kick" in chain:  # also within Predict
        return "kick"
    for function in chain:
        if function in rounds.STAGES:
            return rounds.STAGES[function]
    return "substep" if "RunSubsteps" in chain else "once"


def share_of(chain, stage, sizes):
    """Of the substeps: the share in which the instruction runs."""
    if stage == "kick" and "Predict" not in chain:  # with two steps, only beside the first substep
        return 1 / sizes["substeps"]
    if stage == "solve_elastic":
        of_kind = [rounds.SHARES_OF_GRID_FAMILIES[function] for function in chain
                   if function in rounds.SHARES_OF_GRID_FAMILIES]
        return of_kind[0] if of_kind else 1.0
    if stage == "damp_twist":
        return 1 / rounds.TWIST_PERIOD
    if stage == "refine" or "PlacePin" in chain or "StoreContactViolation" in chain:
        return 1 / sizes["substeps"]
    return 1.0


def count_stages(source, disassembly, sizes):
    """Instructions of all warps of a work group by stage: of one substep, `once` of one step."""
    instructions, labels = sass.parse(disassembly)
    blocks, nexts = sass.blocks_of(sass.successors(instructions, labels))
    loops, reached = sass.loops_of(nexts)
    heads = []
    for loop, line in heads_of(source, instructions, blocks, loops).items():
        text = source.lines[line].strip()
        heads.append((loop, rounds.rounds_of(source.functions[line], "do" if text.startswith("do") else text, sizes)))
    stages = {}
    for block in reached:
        each, of_group = 1.0, None
        for loop, of_loop in heads:
            if block not in loop.blocks:
                continue
            each *= of_loop.each
            if of_loop.warps is not None:
                of_group = of_loop.warps
        for instruction in instructions[slice(*blocks[block])]:
            chain = source.chain(instruction)
            times = each * (rounds.warps_of(chain, sizes) if of_group is None else of_group)
            stage = stage_of(chain)
            stages[stage] = stages.get(stage, 0) + times * share_of(chain, stage, sizes)
    return stages, sum(blocks[block][1] - blocks[block][0] for block in reached)


def complete(sizes, local_size):
    """Sizes that follow from others."""
    particles, links = sizes["particle_count"], sizes["links_per_strip"]
    levels = 0  # as StripLevels, where there are invocations enough
    while links >> levels > 16:
        levels += 1
    return dict(sizes, local_size=local_size, strip_levels=levels, strip_all_levels=(max(links, 1) - 1).bit_length(),
                particles_per_line=max(sizes["grid_columns"], sizes["grid_rows"]),
                lines_per_family=max(sizes["grid_columns"], sizes["grid_rows"]),
                triangles_per_particle=math.ceil(3 * sizes["triangle_count"] / particles),
                elements_per_particle=math.ceil(4 * sizes["elastic_count"] / particles))


def count(compiler, program, glsl, arch):
    """The row of a program: usage, groups, and for kernels of a whole step instructions by stage."""
    cuda = translate.translate(glsl, program["local_size"])
    cubin = compiler.cubin(cuda, program["name"] + ".cu", arch)
    row = {"program": program["name"], "arch": arch, "local_size": program["local_size"], **compiler.usage(cubin)}
    row["groups"], row["limited_by"] = gpus.groups_per_multiprocessor(arch, program["local_size"], row["registers"],
                                                                      row["shared_bytes"])
    sizes = complete(program["sizes"], program["local_size"])
    disassembly = compiler.disassembled(cubin)
    if program["kernel"] == "resident_step":
        stages, row["instructions"] = count_stages(Source(cuda), disassembly, sizes)
        once = stages.pop("once", 0)
        of_substep = sum(stages.values())
        row["substep"] = round(of_substep)
        row["per_particle"] = round(32 * of_substep / sizes["particle_count"])
        row["step"] = round(of_substep * sizes["substeps"] + once)
        row["stages"] = {stage: round(value) for stage, value in sorted(stages.items(), key=lambda item: -item[1])}
    else:
        instructions, _ = sass.parse(disassembly)
        row["instructions"] = len(instructions)
    return row


def check(counted):
    """Says which programs cost more than limits.json allows; True if none does."""
    with open(LIMITS, encoding="utf-8") as file:
        limits = json.load(file)
    worse = []
    for row in counted:
        if row["arch"] != CHECKED:
            continue
        limit = limits.get(row["program"])
        if limit is None:
            worse.append(f"{row['program']}: has no row in {os.path.relpath(LIMITS)}")
            continue
        for key, most in limit.items():
            if row[key] > most:
                worse.append(f"{row['program']}: {key} {row[key]}, at most {most}")
    for line in worse:
        print("worse than the limits:", line, file=sys.stderr)
    return not worse


def write_limits(counted):
    """What is counted now, with 2 % of slack for instructions."""
    limits = {}
    for row in counted:
        if row["arch"] == CHECKED:
            keys = ["registers", "stack_bytes", "shared_bytes"]
            limits[row["program"]] = {key: row[key] for key in keys}
            if "substep" in row:
                limits[row["program"]]["substep"] = math.ceil(1.02 * row["substep"])
    with open(LIMITS, "w", encoding="utf-8") as file:
        json.dump(limits, file, indent=1)
        file.write("\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dump", help="folder that `drape_bench kernels --dump` wrote")
    parser.add_argument("--out", help="folder for kernels.csv, stages.csv and README.md; none: only print")
    parser.add_argument("--arch", action="append", choices=sorted(gpus.ARCHITECTURES), help="default: all of them, and AMD's")
    parser.add_argument("--only", default="", help="programs whose name has this in it")
    parser.add_argument("--keep", help="folder for the CUDA texts and the disassembly")
    parser.add_argument("--check", action="store_true", help=f"compare {CHECKED} with limits.json; exit status 1: worse")
    parser.add_argument("--set-limits", action="store_true", help="write limits.json anew")
    arguments = parser.parse_args()
    compiler = nvrtc.Compiler()
    with open(os.path.join(arguments.dump, "kernels.json"), encoding="utf-8") as file:
        programs = [program for program in json.load(file) if arguments.only in program["name"]]
    texts = {}
    for program in programs:
        with open(os.path.join(arguments.dump, program["name"] + ".glsl"), encoding="utf-8") as file:
            texts[program["name"]] = file.read()
    counted = []
    for program in programs:
        glsl = texts[program["name"]]
        for arch in arguments.arch or sorted(gpus.ARCHITECTURES, key=lambda name: int(name[3:])):
            row = count(compiler, program, glsl, arch)
            counted.append(row)
            print(f"{row['program']:42} {arch:7} {row['registers']:4} registers {row['stack_bytes']:5} B stack "
                  f"{row['shared_bytes']:6} B shared {row['groups']:3} groups ({row['limited_by']}) "
                  f"{row.get('substep', ''):>7}", flush=True)
    of_amd = amd.count(texts) if not arguments.arch else []
    if arguments.set_limits:
        write_limits(counted)
    if arguments.out:
        import report
        report.write(arguments.out, counted, compiler.version(), of_amd)
    return 0 if not arguments.check or check(counted) else 1


if __name__ == "__main__":
    sys.exit(main())
