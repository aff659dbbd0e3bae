// `drape run` with several state files at once: their contents agree.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <sstream>

#include "tests/client/cli_end_to_end_test.h"
#include "tests/client/usda_reader.h"

namespace drape {
namespace {

using client_test::Example;
using client_test::Outcome;
using client_test::ParseUsda;
using client_test::ReadText;
using client_test::RunProgram;
using client_test::TemporaryFolder;
using client_test::UsdaPrim;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

class RunExportsTest : public ::testing::Test {
 protected:
  // `drape run chain.json` for three steps of which two are samples, with these state files.
  Outcome Run(const std::vector<std::string>& names, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"run", Example("chain.json"), "--backend=cpu",
                                          "--duration=0.05", "--quiet"};
    for (const std::string& name : names) {
      arguments.push_back("--states=" + (folder_ / name).string());
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunProgram("drape", arguments);
  }
  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      names.push_back(entry.path().filename());
    }
    return names;
  }
  TemporaryFolder folder_;
};

// Columns 3 to 5 of the rows of a CSV file whose time is `time`, as text.
std::vector<float> CsvPositions(const std::string& text, const std::string& time) {
  std::vector<float> positions;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with(time + ",")) continue;
    std::istringstream row(line);
    std::string cell;
    for (int column = 0; column < 6 && std::getline(row, cell, ','); ++column) {
      if (column >= 3) positions.push_back(std::stof(cell));
    }
  }
  return positions;
}

TEST_F(RunExportsTest, AllFilesOfARunAgree) {
  const Outcome outcome = Run({"s.csv", "s.pc2", "s.usda", "s.obj"}, {"--every=2"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(Names(),
              UnorderedElementsAre("s.csv", "s.pc2", "s.usda", "s_000002.obj", "s_000003.obj"));
  const std::vector<float> last = CsvPositions(ReadText(folder_ / "s.csv"), "0.05");
  ASSERT_EQ(last.size(), 3u * 41);

  const std::string cache = ReadText(folder_ / "s.pc2");
  ASSERT_EQ(cache.size(), 32 + 2 * 4 * last.size());
  EXPECT_EQ(std::memcmp(cache.data() + 32 + 4 * last.size(), last.data(), 4 * last.size()), 0);

  const UsdaPrim chain = ParseUsda(ReadText(folder_ / "s.usda")).prims.at(0).children.at(0);
  EXPECT_EQ(chain.type, "BasisCurves");
  EXPECT_THAT(chain.attributes.at("points").samples,
              ElementsAre(::testing::Key(2), ::testing::Pair(3, last)));
}

TEST_F(RunExportsTest, WithoutEveryGeometryIsOneFile) {
  ASSERT_EQ(Run({"s.obj", "s.ply"}).exit_code, 0);
  EXPECT_THAT(Names(), UnorderedElementsAre("s.obj", "s.ply"));
}

TEST_F(RunExportsTest, ASeriesOfEveryStepIsOneToo) {
  ASSERT_EQ(Run({"s.ply"}, {"--every=1"}).exit_code, 0);
  EXPECT_THAT(Names(), UnorderedElementsAre("s_000001.ply", "s_000002.ply", "s_000003.ply"));
}

TEST_F(RunExportsTest, RefusesUnknownExtensionsAndOneFileTwice) {
  Outcome outcome = Run({"s.csv", "s.usd"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("s.usd does not end in"),
                                 HasSubstr(".csv, .npz, .obj, .pc2, .ply or .usda")));
  outcome = Run({"s.csv", "./s.csv"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("s.csv is also the file of --states"));
  EXPECT_TRUE(Names().empty());
}

}  // namespace
}  // namespace drape
