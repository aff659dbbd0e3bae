// The gl backend's kernels, run as a GPU may run them.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "shaders/interface/bindings.h"
#include "shaders/interface/cloth_record.h"
#include "shaders/interface/self_contact_record.h"
#include "tests/emulator/cloths.h"
#include "tests/emulator/compiled_kernel.h"
#include "tests/emulator/work_groups.h"

namespace drape::emulator {
namespace {

// The first word that differs, in words; empty if none does.
std::string Difference(const Blocks& blocks, const Blocks& expected) {
  for (uint32_t binding = 0; binding < kBindings; ++binding) {
    for (size_t k = 0; k < expected[binding].size(); ++k) {
      if (blocks[binding][k] == expected[binding][k]) continue;
      return "block " + std::to_string(binding) + " word " + std::to_string(k) + ": " +
             std::to_string(blocks[binding][k]) + " instead of " +
             std::to_string(expected[binding][k]);
    }
  }
  return "";
}

class KernelsTest : public testing::TestWithParam<EmulatedCloth> {
 protected:
  static WorkGroups& work_groups() {
    static auto& only = *new WorkGroups;
    return only;
  }
};
std::string NameOfCloth(const testing::TestParamInfo<EmulatedCloth>& info) {
  return info.param.scene.name;
}
// Each has kernels of its own, which take a second to translate and compile.
std::vector<EmulatedCloth> ShortCloths() {
  std::vector<EmulatedCloth> cloths;
  for (EmulatedCloth& cloth : ResidentCloths()) {
    const std::string& name = cloth.scene.name;
    if (name == "from_both_ends" || name == "reduction_by_shuffles" || name == "moving_shapes" ||
        name == "gripped_impulses" || name == "quads_by_shuffles") {
      cloths.push_back(std::move(cloth));
    }
  }
  return cloths;
}
INSTANTIATE_TEST_SUITE_P(Short, KernelsTest, testing::ValuesIn(ShortCloths()), NameOfCloth);
INSTANTIATE_TEST_SUITE_P(ResidentLong, KernelsTest, testing::ValuesIn(ResidentCloths()),
                         NameOfCloth);
class TiledKernelsTest : public KernelsTest {};
INSTANTIATE_TEST_SUITE_P(TiledLong, TiledKernelsTest, testing::ValuesIn(TiledCloths()),
                         NameOfCloth);

// Local sizes to run a kernel with, each in an order of its own. Kernels whose invocations own a
// particle or a link have but one.
std::vector<uint32_t> SizesFor(const std::string& glsl) {
  const uint32_t own = LocalSizeOf(glsl);
  const bool has_one = glsl.find("#define OWNS_PARTICLE") != std::string::npos ||
                       glsl.find("#define STRIP_ROWS") != std::string::npos;
  return {own, has_one ? own : 64u};
}

TEST_P(KernelsTest, NoRaceAndTheBitsOfTheSoftwareRendererInAnyOrder) {
  uint32_t seed = 1;
  uint64_t accesses = 0;
  for (const CapturedDispatch& captured : DispatchesOf(GetParam())) {
    const CompiledKernel& kernel = CompiledKernel::Load(captured.glsl, captured.lines);
    for (const uint32_t local_size : SizesFor(captured.glsl)) {
      SCOPED_TRACE(captured.kernel + " of " + std::to_string(local_size));
      const RunResult result = work_groups().Run(kernel.entry(), captured.dispatch,
                                                 {.local_size = local_size, .seed = seed++});
      accesses += result.access_count;
      EXPECT_EQ(kernel.Describe(result.findings), "");
      ASSERT_EQ(Difference(result.blocks, captured.after), "");
    }
  }
  EXPECT_GT(accesses, 0u);
}

// The largest difference of the states of two runs of a kernel: of positions [m] and velocities
// [m/s] alike. Infinite where either is not a number.
float LargestDifference(const Blocks& a, const Blocks& b) {
  float largest = 0;
  for (size_t k = 0; k < a[DRAPE_BINDING_STATES].size(); ++k) {
    if (a[DRAPE_BINDING_STATES][k] == b[DRAPE_BINDING_STATES][k]) continue;
    const float difference = std::bit_cast<float>(a[DRAPE_BINDING_STATES][k]) -
                             std::bit_cast<float>(b[DRAPE_BINDING_STATES][k]);
    if (!std::isfinite(difference)) return std::numeric_limits<float>::infinity();
    largest = std::max(largest, std::abs(difference));
  }
  return largest;
}

// What errors of roots and quotients may do to a velocity in one step [m/s]. Each of the sweeps of
// each substep has fewer than 8 of them per constraint, off by 2 ulp of a length below 4 m; an
// error of a length is one of a velocity by the substep. Those of all constraints may reach one
// particle.
float LargestEffect(const test::Scene& scene) {
  const StepSettings& settings = scene.parameters.settings;
  const double constraints =
      scene.model->constraint_count() + scene.model->joint_count() + scene.model->elastic_count();
  const double ulp_m = 4.0 * std::numeric_limits<float>::epsilon();
  return static_cast<float>(settings.substeps * settings.max_iterations * constraints * 8 * 2 *
                            ulp_m / settings.substep_s());
}

// Hardware rounds roots and quotients by -1 to +2 ulp. The same operands give the same results, so
// the local size still changes no bit.
TEST_P(KernelsTest, InexactRootsAndQuotientsDoNoHarm) {
  float changed = 0;
  for (const CapturedDispatch& captured : DispatchesOf(GetParam())) {
    const CompiledKernel& kernel = CompiledKernel::Load(captured.glsl, captured.lines);
    SCOPED_TRACE(captured.kernel);
    const auto run = [&](uint32_t local_size, uint32_t seed) {
      return work_groups().Run(
          kernel.entry(), captured.dispatch,
          {.local_size = local_size, .seed = seed, .arithmetic = {.is_inexact = true, .seed = 7}});
    };
    const std::vector<uint32_t> sizes = SizesFor(captured.glsl);
    const RunResult own = run(sizes[0], 1);
    EXPECT_EQ(kernel.Describe(own.findings), "");
    EXPECT_EQ(Difference(run(sizes[1], 2).blocks, own.blocks), "");
    const float largest = LargestDifference(own.blocks, captured.after);
    EXPECT_LE(largest, LargestEffect(GetParam().scene));
    changed = std::max(changed, largest);
    RecordProperty("largest_" + captured.kernel, std::to_string(largest));
  }
  EXPECT_GT(changed, 0) << "no root and no quotient was inexact";
}

// The pairs that wait for a turn, and those of a turn, are in the order of the invocations, which
// no result sees.
void ForgetOrders(const Blocks& before, Blocks& blocks) {
  shader::ClothRecord cloth{};
  std::memcpy(static_cast<void*>(&cloth), before[DRAPE_BINDING_CLOTHS].data(), sizeof cloth);
  shader::SelfContactRecord contacts{};
  std::memcpy(&contacts, &before[DRAPE_BINDING_PARAMETERS][cloth.step.self_contacts],
              sizeof contacts);
  std::fill(&blocks[DRAPE_BINDING_SCRATCH][contacts.pending],
            &blocks[DRAPE_BINDING_SCRATCH][contacts.turns], 0u);
}

// Lists of links are in the order of the invocations, which a sweep does not see; all else has the
// same bits. The number of work groups is that of a kernel's own local size.
void ExpectNoRaceAndTheSameBits(WorkGroups& work_groups, const EmulatedCloth& cloth) {
  uint32_t seed = 1;
  uint64_t accesses = 0;
  for (const CapturedDispatch& captured : DispatchesOf(cloth)) {
    const CompiledKernel& kernel = CompiledKernel::Load(captured.glsl, captured.lines);
    RunResult result = work_groups.Run(kernel.entry(), captured.dispatch,
                                       {.local_size = LocalSizeOf(captured.glsl), .seed = seed++});
    accesses += result.access_count;
    EXPECT_EQ(kernel.Describe(result.findings), "") << captured.kernel;
    if (captured.kernel == "tiled_collect_links") continue;
    Blocks expected = captured.after;
    if (cloth.scene.parameters.self_collision && captured.kernel.starts_with("tiled_")) {
      ForgetOrders(captured.after, result.blocks);
      ForgetOrders(captured.after, expected);
    }
    EXPECT_EQ(Difference(result.blocks, expected), "") << captured.kernel;
  }
  EXPECT_GT(accesses, 0u);
}

TEST_P(TiledKernelsTest, NoRaceAndTheBitsOfTheSoftwareRendererInAnyOrder) {
  ExpectNoRaceAndTheSameBits(work_groups(), GetParam());
}

class SelfContactKernelsTest : public KernelsTest {};
INSTANTIATE_TEST_SUITE_P(Short, SelfContactKernelsTest, testing::Values(TouchingCloths().front()),
                         NameOfCloth);
INSTANTIATE_TEST_SUITE_P(TiledLong, SelfContactKernelsTest, testing::ValuesIn(TouchingCloths()),
                         NameOfCloth);

TEST_P(SelfContactKernelsTest, NoRaceAndTheBitsOfTheSoftwareRendererInAnyOrder) {
  ExpectNoRaceAndTheSameBits(work_groups(), GetParam());
}

}  // namespace
}  // namespace drape::emulator
