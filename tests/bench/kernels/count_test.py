"""Tests of the counting, without a compiler."""
import os
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import count
import gpus
import rounds
import sass
import translate

# Two loops, one in the other, as nvdisasm writes them.
LOOPS = """
	//## File "k.cu", line 3
        /*0000*/                   MOV R0, RZ ;
.L_x_0:
	//## File "k.cu", line 5 inlined at "k.cu", line 3
	//## File "k.cu", line 3
        /*0010*/                   MOV R1, RZ ;
.L_x_1:
        /*0020*/                   FADD R2, R2, R3 ;
        /*0030*/              @P0  BRA `(.L_x_1) ;
        /*0040*/              @!P1 BRA `(.L_x_0) ;
        /*0050*/                   EXIT ;
.L_x_2:
        /*0060*/                   BRA `(.L_x_2);
"""


class Sass(unittest.TestCase):
    def test_lines_lead_from_the_innermost_function_out(self):
        instructions, labels = sass.parse(LOOPS)
        self.assertEqual([i.lines for i in instructions[:3]], [(3,), (5, 3), (5, 3)])
        self.assertEqual(labels[".L_x_1"], 2)

    def test_loops_are_found_outer_first_and_dead_code_is_left_out(self):
        instructions, labels = sass.parse(LOOPS)
        blocks, nexts = sass.blocks_of(sass.successors(instructions, labels))
        loops, reached = sass.loops_of(nexts)
        sizes = [sum(blocks[b][1] - blocks[b][0] for b in loop.blocks) for loop in loops]
        self.assertEqual(sizes, [4, 2])
        self.assertEqual(sum(blocks[b][1] - blocks[b][0] for b in reached), 6)


class Rounds(unittest.TestCase):
    SIZES = {"local_size": 256, "particle_count": 1024, "strips_per_phase": 32, "strip_phase_count": 2}

    def shared_out(self, end):
        return f"for (uint i = (0u) + gl_LocalInvocationID.x; i < ({end}); i += 256) {{"

    def test_a_list_is_shared_out_over_the_warps(self):
        self.assertEqual(rounds.rounds_of("X", self.shared_out("cloth.particle_count"), self.SIZES).warps, 32)
        few = rounds.rounds_of("X", self.shared_out("(cloth.particle_count + 31u) / 32u"), self.SIZES)
        self.assertEqual(few.warps, 1)

    def test_constant_and_known_loops(self):
        self.assertEqual(rounds.rounds_of("X", "for (uint s = 1u; s < 32u; s *= 2u) {", self.SIZES).each, 5)
        self.assertEqual(rounds.rounds_of("X", "for (int k = 0; k < 3; ++k) {", self.SIZES).each, 3)
        head = "for (uint first = models[cloth.model.strip_phase_lanes + phase]; first < end; first += LaneCount()) {"
        sizes = dict(self.SIZES, lanes_per_phase=128, local_size=64)
        self.assertEqual(rounds.rounds_of("ReduceStrips", head, sizes).each, 2)
        self.assertEqual(rounds.warps_of(["SolveLane"], dict(sizes, local_size=1024)), 4)

    def test_an_unknown_loop_is_named(self):
        with self.assertRaisesRegex(SystemExit, "for \\(;;\\).*in Strange"):
            rounds.rounds_of("Strange", "for (;;) {", self.SIZES)


class Gpus(unittest.TestCase):
    # NVIDIA's occupancy calculator.
    def test_groups_per_multiprocessor(self):
        self.assertEqual(gpus.groups_per_multiprocessor("sm_90", 256, 120, 30732), (2, "registers"))
        self.assertEqual(gpus.groups_per_multiprocessor("sm_90", 256, 48, 30732), (5, "registers"))
        self.assertEqual(gpus.groups_per_multiprocessor("sm_90", 256, 32, 30732), (7, "shared memory"))
        self.assertEqual(gpus.groups_per_multiprocessor("sm_90", 1024, 24, 0), (2, "warps"))

    def test_cloths_at_60_hz(self):
        self.assertAlmostEqual(gpus.cloths_at_60_hz("H200", 132 * 4 * 1.7e9 / 60), 1.0)


class Translation(unittest.TestCase):
    GLSL = """#version 450 core
#extension GL_KHR_shader_subgroup_basic : require
#define N 4
struct Pair { float a; vec3 b; };
layout(local_size_x = 32) in;
layout(std430, binding = 0) restrict readonly buffer Words { uint words[]; };
layout(location = 1) uniform uint first;
const uint kMore = N + 1;
shared float sums[kMore];
vec3 Scale(inout Pair pair, float s) {
  precise vec3 v = pair.b.xyz * (s + 1.0);
  for (uint k = 0u; k < words[first]; ++k) pair.a += .5;
  return v;
}
void main() {}
"""

    def test_glsl_becomes_cuda(self):
        cuda = translate.translate(self.GLSL, 32)
        for expected in ("__shared__ float sums[kMore];", "constexpr uint kMore = 4 + 1;",
                         "GLSL vec3 Scale(Pair& pair, float s)", "vec3 v = pair.b.xyz() * (s + 1.0f);",
                         "#pragma unroll 1\nfor (uint k = 0u; k < words[first]; ++k) pair.a += .5f;",
                         "const uint* __restrict__ words;", "kernel(const uint* __restrict__ words_, uint first_)"):
            self.assertIn(expected, cuda)

    def test_functions_are_found_by_line(self):
        source = count.Source("GLSL vec3 A(float x) {\nreturn x;\n}\nGLSL void B() {\n}\n")
        self.assertEqual(source.functions[1:6], ["A", "A", "A", "B", "B"])


if __name__ == "__main__":
    unittest.main()
