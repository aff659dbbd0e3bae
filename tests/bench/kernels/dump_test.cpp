#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/bench/kernels/dump.h"
#include "tests/bench/shell.h"
#include "tests/support/paths/paths.h"

namespace drape::bench {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(DumpKernelsTest, EachProgramIsWholeAndTheSizesAreThoseOfItsCloth) {
  const ScratchFolder scratch;
  const fs::path& folder = scratch.path();
  DumpKernels({.dump = folder, .shader_dir = ""});
  const nlohmann::json programs = nlohmann::json::parse(ReadText(folder / "kernels.json"));
  int resident = 0;
  for (const auto& program : programs) {
    const std::string text = ReadText(folder / (program["name"].get<std::string>() + ".glsl"));
    EXPECT_THAT(text, HasSubstr("#version 450 core\n")) << program["name"];
    EXPECT_THAT(text, Not(HasSubstr("#include"))) << program["name"];
    EXPECT_THAT(text, HasSubstr("void main()")) << program["name"];
    EXPECT_THAT(text, HasSubstr("#define LOCAL_SIZE " +
                                std::to_string(program["local_size"].get<int>()) + "\n"));
    if (program["kernel"] == "resident_step") ++resident;
  }
  EXPECT_EQ(resident, 10);
  EXPECT_EQ(programs[0]["name"], "two_corners.resident_step");
  EXPECT_EQ(programs[0]["strips"], "reduction");
  EXPECT_EQ(programs[1]["strips"], "elimination");
  EXPECT_EQ(programs[2]["strips"], "both_ends");
  const nlohmann::json& sizes = programs[0]["sizes"];
  EXPECT_EQ(sizes["particle_count"], 1024);
  EXPECT_EQ(sizes["strips_per_phase"], 32);
  EXPECT_EQ(sizes["links_per_strip"], 31);
  EXPECT_EQ(sizes["tethers_per_particle"], 2);
}

TEST(CountKernelsTest, TheCountingIsRightWithoutACompiler) {
  const Ending ending =
      RunShell("python3 -B " + test::SourcePath("tests/bench/kernels/count_test.py").string());
  EXPECT_EQ(ending.exit_status, 0) << ending.text;
}

}  // namespace
}  // namespace drape::bench
