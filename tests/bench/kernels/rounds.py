"""How often the loops of the kernels run, found by their text, and the stage that an instruction belongs to."""
import math
import re

# Functions of resident_step.comp that are a stage, by the name of the stage.
STAGES = {"BeginSubstep": "substep", "Kick": "kick", "Predict": "predict", "SolveElastic": "solve_elastic",
          "SolveHinges": "solve_hinges", "DampTwist": "damp_twist", "Tether": "tether", "SolveStrips": "solve_strips",
          "Refine": "refine", "SolveDistance": "solve_distance", "SolveJoints": "solve_joints",
          "SolveContacts": "solve_contacts", "Integrate": "integrate"}
# The families of a grid with bending and shear: two of rods, one of cells, two of diagonals (scene/elastic_lines.h).
SHARES_OF_GRID_FAMILIES = {"SolveRods": 2 / 5, "SolveCells": 1 / 5, "ApplyCells": 1 / 5, "SolveDiagonals": 2 / 5}
TWIST_PERIOD = 4  # substeps (solver/substep_schedule.h)

# Loops that are no plain count: (function, part of the head) -> an expression in the sizes of dump.cpp.
ROUNDS = {
    ("RunSubsteps", "progress"): "1",  # what is counted is one substep
    ("Solve", "outcome"): "max_iterations",
    ("SolveStrips", "phase"): "strip_phase_count",
    ("ReduceStrips", "first"): "ceil(lanes_per_phase / local_size)",
    ("TakeLargest", "lane"): "32",
    ("EliminateStrip", "k"): "links_per_strip",
    ("ApplyImpulses", "k"): "links_per_strip",
    # From both ends: two invocations per system; of two phases one has a strip that meets pins, which takes all levels.
    ("ReduceRows", "level"): "(strip_levels + strip_all_levels) / 2",
    ("EliminateRows", "left"): "ceil(links_per_strip / 2 ** (strip_levels + 1))",
    ("SubstituteBack", "left"): "ceil(links_per_strip / 2 ** (strip_levels + 1))",
    ("FirstPin", "row"): "1",
    ("RemoveExcess", "k"): "links_per_strip",
    ("SolveStrip", "do"): "1",  # more only where impulses are cut
    ("TetherParticle", "t"): "tethers_per_particle",
    ("Refine", "k"): "1",
    ("SolveElastic", "k"): "elastic_family_count",
    ("SolveRods", "k"): "particles_per_line",
    ("SolveDiagonals", "k"): "particles_per_line",
    ("SolveCells", "k"): "particles_per_line",
    ("ImpulseOfTriangles", ""): "triangles_per_particle",
    ("ApplyElasticImpulses", ""): "elements_per_particle",
    ("ImpulseOfElements", "k"): "elements_per_particle",
    ("RefineFlaggedLinks", "colour"): "colour_count",
    ("SolveDistance", "colour"): "colour_count",
    ("SolveContactsOf", "c"): "collider_count",
    ("StoreContactViolation", "c"): "collider_count",
    ("VelocityAfterContacts", "c"): "collider_count",
    ("RestsOnCollider", "c"): "collider_count",
    ("StoreRebounds", "c"): "collider_count",
    ("IsApart", "k"): "2",
    ("EnergyChange", "i"): "ceil(particle_count / 32)",
    ("EnergyChange", "k"): "ceil(pin_count / 32)",
    ("StoredChange", "k"): "ceil(constraint_count / 32)",
    ("StoredChange", "e"): "ceil(elastic_count / 32)",
}
# Loops that give each invocation every LOCAL_SIZE-th of a list: the length of lists with ends of their own.
LISTS = {
    ("SolvePhase", "strip"): "strips_per_phase",
    ("RefineFlaggedLinks", "k"): "links_per_colour",
    ("SolveDistance", "k"): "links_per_colour",
    ("SolveElastic", "line"): "lines_per_family",
    ("FindReach", "c"): "collider_count",
}


# Loops that compilers unroll: no loop of the machine code is theirs.
UNROLLED = {("ReduceLink", "for (uint level")}

# What only the warps run that have systems, of those that run MeetStrips.
OF_HALVES = {"EliminateRows", "MeetingImpulse", "SubstituteBack"}
# What runs only where impulses are cut.
RARE = {"RemoveExcess", "TakeLargest"}


def warps_of(chain, sizes):
    """Warps of the group that run the instruction."""
    warps = math.ceil(sizes["local_size"] / 32)
    if RARE.intersection(chain):
        return 0
    if "SolveLane" in chain:
        return min(warps, math.ceil(sizes["lanes_per_phase"] / 32))
    if "MeetStrips" not in chain or not OF_HALVES.intersection(chain):
        return warps
    return min(warps, math.ceil(2 * sizes["strips_per_phase"] * 2 ** sizes["strip_levels"] / 32))


def evaluate(text, sizes):
    return eval(text, {"__builtins__": {}, "ceil": math.ceil, "min": min}, sizes)  # texts of this file and of shaders in this tree


def bound(text, sizes):
    """A bound such as (cloth.particle_count + 31u) / 32u; None if it is not made of sizes."""
    text = re.sub(r"cloth\.(step\.)?|\b(?<=\d)u\b", "", text)
    text = re.sub(r"(\d)u\b", r"\1", text).replace("/", "//")
    try:
        return int(evaluate(text, sizes))
    except (NameError, SyntaxError, TypeError):
        return None


class Rounds:
    """Of a loop: `warps`: rounds of all warps of the group together, if it shares a list out; else rounds of each."""

    def __init__(self, each=1.0, warps=None):
        self.each, self.warps = each, warps


def rounds_of(function, head, sizes):
    """Of the loop with this text in this function."""
    local_size = sizes["local_size"]
    shared_out = re.search(r"for \(uint (\w+) = (\(.*\) \+ )?gl_LocalInvocationID\.x; \1 < (.*); \1 \+= \d+u?\)", head)
    if shared_out:
        name, _, end = shared_out.groups()
        count = bound(end, sizes)
        if count is None and (function, name) in LISTS:
            count = math.ceil(evaluate(LISTS[function, name], sizes))
        if count is None:
            raise SystemExit(f"kernels/rounds.py: how long is the list of «{head}» in {function}? Add it to LISTS")
        warps = sum(math.ceil((count - 32 * warp) / local_size) for warp in range(math.ceil(local_size / 32))
                    if count > 32 * warp)
        return Rounds(warps=warps)
    constant = re.search(r"for \(u?int (\w+) = (\d+)u?; \1 < (\d+)u?; (\+\+|\1 \*= 2u)", head)
    if constant:
        first, last = int(constant.group(2)), int(constant.group(3))
        return Rounds(each=last - first if constant.group(4) == "++" else math.log2(last / first))
    for (of, part), count in ROUNDS.items():
        if of == function and (head.startswith(part) or re.search(rf"\b{re.escape(part)}\b" if part else "", head)):
            return Rounds(each=max(1, evaluate(count, sizes)))
    raise SystemExit(f"kernels/rounds.py: how often does «{head}» in {function} run? Add it to ROUNDS")
