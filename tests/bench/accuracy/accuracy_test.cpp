// `drape_bench accuracy` as a user runs it, with the smallest sizes, and the scripts that read its
// tables.
#include "tests/bench/accuracy/accuracy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/bench/shell.h"
#include "tests/support/paths/paths.h"

namespace drape::bench {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using Row = std::map<std::string, std::string>;

std::vector<std::string> Split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

std::vector<Row> ReadRows(const fs::path& csv) {
  std::istringstream text(ReadText(csv));
  std::string line;
  std::getline(text, line);
  const std::vector<std::string> columns = Split(line);
  std::vector<Row> rows;
  while (std::getline(text, line)) {
    const std::vector<std::string> cells = Split(line);
    Row row;
    for (size_t k = 0; k < cells.size(); ++k) row[columns.at(k)] = cells[k];
    rows.push_back(row);
  }
  return rows;
}

class AccuracyTest : public testing::Test {
 protected:
  Ending Bench(const std::string& arguments) const {
    return RunShell(test::ProgramPath("drape_bench").string() + " accuracy " + arguments +
                    " --quick --out=" + out_.string());
  }
  Ending Tables(const std::string& arguments = "") const {
    return RunShell("python3 -B " + test::SourcePath("tests/bench/tables.py").string() + " " +
                    arguments + out_.string());
  }

  ScratchFolder folder_;
  const fs::path out_ = folder_.path();
};

TEST_F(AccuracyTest, MeasuresEverySceneOnEveryBackendAndTheScriptSaysWhatItMeans) {
  const Ending ending = Bench("--play-s=600 --method='mine: substeps=3 max_iterations=7'");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  std::map<std::string, int> presets, peers, own;
  for (const Row& row : ReadRows(out_ / "accuracy.csv")) {
    EXPECT_EQ(row.at("status"), "ok") << row.at("scene") << ", " << row.at("method");
    EXPECT_GT(std::stod(row.at("wall_ms_per_s")), 0);
    const std::string& method = row.at("method");
    if (method == "PAPER" || method == "REALTIME" || method == "ACCURATE")
      ++presets[row.at("scene")];
    if (row.at("backend") == "bullet") ++peers[row.at("scene")];
    if (method == "mine") {
      ++own[row.at("scene")];
      EXPECT_THAT(row.at("settings"),
                  AllOf(HasSubstr(" substeps=3 "), HasSubstr("max_iterations=7 ")));
    }
  }
  EXPECT_EQ(presets.size(), 5u);
  for (const auto& [scene, count] : presets) EXPECT_EQ(count, 3 * 3) << scene;
  for (const auto& [scene, count] : own) EXPECT_EQ(count, 1) << scene;
  EXPECT_EQ(own.size(), presets.size());
  EXPECT_EQ(peers.size(), 2u);
  for (const Row& row : ReadRows(out_ / "accuracy_references.csv")) {
    EXPECT_LT(std::stod(row.at("error_m")), 1e-8) << row.at("scene");
  }

  std::map<std::string, int> quantities;
  for (const Row& row : ReadRows(out_ / "accuracy_quantities.csv")) {
    ++quantities[row.at("kind")];
    EXPECT_TRUE(std::isfinite(std::stod(row.at("value")))) << row.at("scene");
  }
  EXPECT_EQ(quantities.size(), 9u);

  const Ending made = Tables();
  ASSERT_EQ(made.exit_status, 0) << made.text;
  const std::string readme = ReadText(out_ / "README.md");
  EXPECT_THAT(readme, HasSubstr("### Bars"));
  EXPECT_THAT(readme, HasSubstr("- **pendulum**, 2 particles, 2 s:"));
  EXPECT_THAT(readme, HasSubstr("### The same on every backend"));
  EXPECT_THAT(readme, HasSubstr("### Order of convergence"));
  EXPECT_THAT(readme, HasSubstr("| sphere_9: Bullet 1x10 |"));
  EXPECT_THAT(readme, HasSubstr("curtain_column, "));
  EXPECT_THAT(readme, HasSubstr("| slope, REALTIME: holds at 1.02 × for 2 s | ≤ 0.1 mm |"));
  EXPECT_THAT(readme, HasSubstr("| 8 x 8 at 1/60 s: sag of the first row [m] |"));
}

TEST_F(AccuracyTest, UnknownScenesAndSettingsAreNamedWithWhatIsLegal) {
  const Ending scene = Bench("--scenes=hammock --backends=cpu");
  EXPECT_EQ(scene.exit_status, 1);
  EXPECT_THAT(scene.text, AllOf(HasSubstr("'hammock' is none of"), HasSubstr("pendulum")));
  const Ending method = Bench("--method='mine: sweeps=3' --backends=cpu");
  EXPECT_EQ(method.exit_status, 1);
  EXPECT_THAT(method.text, AllOf(HasSubstr("sweeps"), HasSubstr("max_iterations")));
}

TEST_F(AccuracyTest, AKindOfQuantitiesAloneLeavesTheOtherTablesOut) {
  ASSERT_EQ(Bench("--quantities=slope --backends=cpu").exit_status, 0);
  EXPECT_FALSE(fs::exists(out_ / "accuracy.csv"));
  for (const Row& row : ReadRows(out_ / "accuracy_quantities.csv")) {
    EXPECT_EQ(row.at("kind"), "slope");
  }
  ASSERT_EQ(Tables().exit_status, 0);
  const Ending unknown = Bench("--quantities=hem --backends=cpu");
  EXPECT_EQ(unknown.exit_status, 1);
  EXPECT_THAT(unknown.text, AllOf(HasSubstr("'hem' is none of"), HasSubstr("cantilever")));
}

TEST_F(AccuracyTest, OneSceneAloneLeavesTheOtherTablesOut) {
  ASSERT_EQ(Bench("--scenes=pendulum --backends=cpu").exit_status, 0);
  EXPECT_FALSE(fs::exists(out_ / "accuracy_order.csv"));
  ASSERT_EQ(Tables().exit_status, 0);
  EXPECT_THAT(ReadText(out_ / "README.md"), HasSubstr("not measured"));
}

// The verdicts of the script on rows whose verdict is known.
class BarsTest : public AccuracyTest {
 protected:
  void SetUp() override {
    ASSERT_EQ(Bench("--scenes=pendulum --backends=cpu").exit_status, 0);
    header_ = ReadText(out_ / "accuracy.csv");
    header_ = header_.substr(0, header_.find('\n') + 1);
  }

  static std::string Row(const std::string& backend, const std::string& method,
                         double wall_ms_per_s, double max_strain, double rms_strain) {
    std::ostringstream row;
    row << "two_corners_32,1024,5," << backend << "," << method << "," << method << ",1,1,x,ok,3,"
        << wall_ms_per_s << ",1,1,1," << max_strain << "," << rms_strain
        << ",nan,nan,nan,nan,nan\n";
    return row.str();
  }

  std::string Readme(const std::string& rows) {
    WriteFile(out_ / "accuracy.csv", header_ + rows);
    const Ending made = Tables();
    EXPECT_EQ(made.exit_status, 0) << made.text;
    static const std::regex kWrapped("\n +");
    return std::regex_replace(ReadText(out_ / "README.md"), kWrapped, " ");
  }

  std::string header_;
};

TEST_F(BarsTest, HoldWhenErrorAndTimeDo) {
  const std::string paper = Row("cpu", "PAPER", 100, 0.3, 0.04);
  EXPECT_THAT(
      Readme(paper + Row("cpu", "REALTIME", 90, 0.015, 5e-5)),
      AllOf(
          HasSubstr("max strain | ≤ 2 % | ≤ 0.3 % | 1.5 % (90.0 ms/s, 0.90 × PAPER) | yes | NO |"),
          HasSubstr("0.005 % (90.0 ms/s, 0.90 × PAPER) | yes | yes |")));
  EXPECT_THAT(Readme(paper + Row("cpu", "REALTIME", 130, 0.015, 5e-5)),
              HasSubstr("1.5 % (130 ms/s, 1.30 × PAPER > 1) | NO | NO |"));
}

TEST_F(BarsTest, FrontsAndLossesAreNamed) {
  const std::string readme =
      Readme(Row("cpu", "PAPER", 100, 0.3, 0.04) + Row("cpu", "REALTIME", 90, 0.02, 1e-3) +
             Row("cpu", "better", 50, 0.01, 5e-4) + Row("bullet", "peer", 40, 0.005, 1e-4));
  EXPECT_THAT(readme, HasSubstr("max strain: better (50.0 ms/s: 1 %)."));
  EXPECT_THAT(readme,
              HasSubstr("REALTIME 90.0 ms/s, 2 %: 2.0 times the error of better (50.0 ms/s)"));
  EXPECT_THAT(readme, HasSubstr("peer has less max strain than REALTIME in no more time"));
  EXPECT_THAT(readme, HasSubstr("no setting of ours reaches the max strain of peer in its time"));
  EXPECT_THAT(
      Readme(Row("cpu", "PAPER", 100, 0.3, 0.04) + Row("cpu", "REALTIME", 90, 0.005, 1e-4) +
             Row("bullet", "peer", 95, 0.1, 1e-2)),
      AllOf(HasSubstr("Nowhere among these scenes."), Not(HasSubstr("no setting of ours"))));
}

}  // namespace
}  // namespace drape::bench
