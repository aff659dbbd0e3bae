// The gl backend's kernels, run as a GPU may run them.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

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
    if (name == "from_both_ends" || name == "reduction_by_shuffles" || name == "moving_shapes") {
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

TEST_P(KernelsTest, NoRaceAndTheBitsOfTheSoftwareRendererInAnyOrder) {
  uint32_t seed = 1;
  uint64_t accesses = 0;
  for (const CapturedDispatch& captured : DispatchesOf(GetParam())) {
    const CompiledKernel& kernel = CompiledKernel::Load(captured.glsl, captured.lines);
    for (const uint32_t local_size : {LocalSizeOf(captured.glsl), 64u}) {
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

// Bits are not compared: lists of links are in the order of the invocations, which a sweep does not
// see. The number of work groups is that of a kernel's own local size.
TEST_P(TiledKernelsTest, NoRaceInAnyOrder) {
  uint32_t seed = 1;
  uint64_t accesses = 0;
  for (const CapturedDispatch& captured : DispatchesOf(GetParam())) {
    const CompiledKernel& kernel = CompiledKernel::Load(captured.glsl, captured.lines);
    const RunResult result =
        work_groups().Run(kernel.entry(), captured.dispatch,
                          {.local_size = LocalSizeOf(captured.glsl), .seed = seed++});
    accesses += result.access_count;
    EXPECT_EQ(kernel.Describe(result.findings), "") << captured.kernel;
  }
  EXPECT_GT(accesses, 0u);
}

}  // namespace
}  // namespace drape::emulator
