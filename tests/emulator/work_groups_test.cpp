// Faults planted in kernels are found, and where they are.
#include "tests/emulator/work_groups.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/emulator/cloths.h"
#include "tests/emulator/compiled_kernel.h"

namespace drape::emulator {
namespace {

using testing::HasSubstr;

// What the emulator says of a kernel of two work groups whose `main` has this body.
std::string FoundIn(const std::string& body) {
  const std::string glsl =
      "#version 450 core\n"
      "#define LOCAL_SIZE 64\n"
      "layout(local_size_x = LOCAL_SIZE) in;\n"
      "layout(std430, binding = 0) restrict buffer Sums { uint sums[]; };\n"
      "layout(std430, binding = 1) restrict coherent buffer Parts { uint parts[]; };\n"
      "shared uint shared_parts[LOCAL_SIZE];\n"
      "void main() {\n"
      "uint k = gl_LocalInvocationID.x;\n"
      "uint other = (k + 40u) % 64u;\n"
      "uint mine = gl_WorkGroupID.x * 64u;\n" +
      body + "\n}\n";
  const CompiledKernel& kernel = CompiledKernel::Load(glsl, {});
  Dispatch dispatch;
  dispatch.group_count = {2, 1, 1};
  dispatch.blocks[0].assign(128, 0);
  dispatch.blocks[1].assign(128, 0);
  WorkGroups work_groups;
  return kernel.Describe(work_groups.Run(kernel.entry(), dispatch, {.local_size = 64}).findings);
}

TEST(WorkGroupsTest, NothingIsWrongWithRightKernels) {
  EXPECT_EQ(FoundIn("shared_parts[k] = k; memoryBarrierShared(); barrier();\n"
                    "sums[mine + k] = shared_parts[other];"),
            "");
  EXPECT_EQ(FoundIn("parts[mine + k] = k; memoryBarrierBuffer(); barrier();\n"
                    "sums[mine + k] = parts[mine + other]; atomicAdd(parts[mine + k], 0u);")
                .find("unwritten"),
            std::string::npos);
  EXPECT_EQ(FoundIn("atomicAdd(sums[0], k);"), "");
  EXPECT_EQ(FoundIn("sums[0] = 7u;"), "") << "all write the same";
}

TEST(WorkGroupsTest, Races) {
  EXPECT_THAT(FoundIn("shared_parts[k] = k; sums[mine + k] = shared_parts[other];"),
              HasSubstr("race"));
  EXPECT_THAT(FoundIn("sums[mine] = k;"), HasSubstr("race"));
  EXPECT_THAT(FoundIn("sums[k] = gl_WorkGroupID.x + 1u;"), HasSubstr("of group"))
      << "of two work groups";
  EXPECT_THAT(FoundIn("if (k == 3u) sums[mine] = 1u; atomicAdd(sums[mine], 1u);"),
              HasSubstr("race"));
}

TEST(WorkGroupsTest, WhatBarriersAloneDoNotShow) {
  EXPECT_THAT(FoundIn("shared_parts[k] = k; barrier(); sums[mine + k] = shared_parts[other];"),
              HasSubstr("no memory barrier after the write"));
  EXPECT_THAT(FoundIn("sums[mine + k] = k; memoryBarrierBuffer(); barrier();\n"
                      "parts[mine + k] = sums[mine + other];"),
              HasSubstr("the block is not coherent"));
}

TEST(WorkGroupsTest, OtherFaults) {
  EXPECT_THAT(FoundIn("sums[mine + k] = shared_parts[k];"), HasSubstr("unwritten"));
  EXPECT_THAT(FoundIn("sums[mine + k + 1u] = 1u;"), HasSubstr("128 of 128"));
  EXPECT_THAT(FoundIn("if (k < 5u) return; barrier();"), HasSubstr("has ended"));
  EXPECT_THAT(FoundIn("if (k < 5u) { barrier(); } else { sums[mine + k] = 1u; barrier(); }"),
              HasSubstr("waits elsewhere"));
}

// In the resident step of a sheet, `from` becomes `to`.
std::string FoundInStep(const std::string& from, const std::string& to) {
  for (CapturedDispatch& captured : DispatchesOf(ResidentCloths().front())) {
    if (captured.kernel != "resident_step") continue;
    const size_t place = captured.glsl.find(from);
    if (place == std::string::npos) return "the kernel has no " + from;
    captured.glsl.replace(place, from.size(), to);
    const CompiledKernel& kernel = CompiledKernel::Load(captured.glsl, captured.lines);
    WorkGroups work_groups;
    return kernel.Describe(
        work_groups.Run(kernel.entry(), captured.dispatch, {.local_size = 64}).findings);
  }
  return "no step";
}

TEST(PlantedFaultsTest, AMissingBarrierOfTheStep) {
  const std::string tether = "FOR_EACH_PARTICLE(i) TetherParticle(i);\n";
  EXPECT_THAT(FoundInStep(tether + "  PhaseBarrier();\n", tether + "\n"),
              HasSubstr("race at stages/access_resident.glsl"));
}

TEST(PlantedFaultsTest, AnUnguardedWriteOfTheStep) {
  EXPECT_THAT(FoundInStep("if (gl_LocalInvocationID.x == 0u) {\n    shared_fault = 0u;",
                          "{\n    shared_fault = gl_LocalInvocationID.x;"),
              HasSubstr("race at kernels/resident_step.comp"));
}

}  // namespace
}  // namespace drape::emulator
