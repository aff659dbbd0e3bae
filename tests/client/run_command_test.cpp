// The contract of `drape run`: report, states, --set, --compare, controls, errors, exit codes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <map>
#include <numeric>
#include <sstream>

#include "tests/client/cli_end_to_end_test.h"

namespace drape {
namespace {

using client_test::Example;
using client_test::Outcome;
using client_test::ReadText;
using client_test::RunForReport;
using client_test::RunProgram;
using client_test::TemporaryFolder;
using client_test::WriteText;
using nlohmann::ordered_json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Four free particles and nothing that holds them: free fall, whose states are known; with one
// substep of a quarter second under 8 m/s^2 every number on the way is a float.
constexpr char kFreeFall[] = R"({
  "name": "free_fall", "time_step_s": 0.25, "duration_s": 1.3,
  "cloths": [{"count": 3, "spacing_m": 2,
    "spec": {"grid": {"columns": 2, "rows": 2, "width_m": 1, "height_m": 1},
             "environment": {"gravity_m_per_s2": [0, -8, 0]}, "settings": {"substeps": 1}}}]})";

class RunCommandTest : public ::testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& text) {
    WriteText(folder_ / name, text);
    return folder_ / name;
  }
  // `drape run` on the cpu backend.
  Outcome Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"run", "--backend=cpu"});
    return RunProgram("drape", arguments);
  }
  TemporaryFolder folder_;
};

// A row of S.csv as numbers.
std::vector<std::vector<double>> ReadCsv(const std::string& text) {
  std::istringstream stream(text);
  std::string line;
  std::getline(stream, line);
  EXPECT_EQ(line, "time_s,cloth,particle,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s");
  std::vector<std::vector<double>> rows;
  while (std::getline(stream, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(std::stod(cell));
    EXPECT_EQ(rows.back().size(), 9u) << line;
  }
  return rows;
}

// Samples at steps 2, 4 and 5 (llround(1.3 / 0.25) = 5): every second, and always the last.
TEST_F(RunCommandTest, SamplesEveryNthStepAndTheLast) {
  const std::string scene = Write("scene.json", kFreeFall);
  const std::string states = folder_ / "s.csv";
  const ordered_json report = RunForReport(scene, {"--every=2", "--states=" + states});
  EXPECT_EQ(report["steps"], 5);
  ASSERT_EQ(report["cloths"].size(), 3u);
  for (const ordered_json& cloth : report["cloths"]) {
    std::vector<int> steps;
    for (const ordered_json& sample : cloth["samples"]) steps.push_back(sample["step"]);
    EXPECT_THAT(steps, ::testing::ElementsAre(2, 4, 5));
    EXPECT_EQ(cloth["samples"][2]["time_s"], 1.25);
  }
  const auto rows = ReadCsv(ReadText(states));
  ASSERT_EQ(rows.size(), 3u * 3 * 4);
  for (size_t k = 0; k < rows.size(); ++k) {
    const std::vector<double>& row = rows[k];
    const double time = std::vector<double>{0.5, 1, 1.25}[k / 12];
    EXPECT_EQ(row[0], time);
    EXPECT_EQ(row[1], static_cast<double>(k / 4 % 3)) << "scene order";
    EXPECT_EQ(row[2], static_cast<double>(k % 4));
    EXPECT_EQ(row[3], 2 * row[1] + static_cast<double>(k % 2)) << "copies lie 2 m apart along +x";
    EXPECT_EQ(row[4], -4 * time * time);
    EXPECT_EQ(row[7], -8 * time);
  }
}

// 17 digits from the double backend, 9 from the others: each text gives back its bits.
TEST_F(RunCommandTest, DigitsFollowThePrecisionOfTheBackend) {
  const std::string scene = Write("scene.json", kFreeFall);
  for (const auto& [backend, digits] :
       std::map<std::string, size_t>{{"cpu", 9}, {"reference", 17}}) {
    const std::string states = folder_ / (backend + ".csv");
    RunForReport(scene, {"--states=" + states, "--set", "environment.gravity_m_per_s2=[0,-1.1,0]"},
                 backend);
    size_t longest = 0;
    std::istringstream cells(ReadText(states).substr(75));
    for (std::string cell; std::getline(cells, cell, ',');) {
      if (cell.find_first_of("e\n") != std::string::npos) continue;
      std::erase_if(cell, [](char c) { return c == '-' || c == '.'; });
      cell.erase(0, std::min(cell.find_first_not_of('0'), cell.size()));
      longest = std::max(longest, cell.size());
    }
    EXPECT_EQ(longest, digits) << backend;
  }
}

TEST_F(RunCommandTest, WritesGeometryOfTheLastState) {
  const std::string scene = Write("scene.json", kFreeFall);
  for (const char* name : {"s.obj", "s.ply", "s.npz"}) {
    const Outcome outcome = Run({scene, std::string("--states=") + (folder_ / name).string()});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  // The corner that starts at the origin has fallen 4 t^2 = 6.25 m; grids have 2 triangles per
  // cell.
  EXPECT_THAT(ReadText(folder_ / "s.obj"),
              AllOf(HasSubstr("o cloth_2\n"), HasSubstr("v 0 -6.25 0\n"), HasSubstr("f 1 3 2\n"),
                    HasSubstr("f 10 11 12\n")));
  EXPECT_THAT(ReadText(folder_ / "s.ply"),
              AllOf(HasSubstr("element vertex 12\n"), HasSubstr("element face 6\n")));
  EXPECT_EQ(ReadText(folder_ / "s.npz").substr(0, 2), "PK");
}

TEST_F(RunCommandTest, AZeroDurationGivesNoSamples) {
  const std::string scene = Write("scene.json", kFreeFall);
  const std::string states = folder_ / "s.csv";
  const ordered_json report = RunForReport(scene, {"--duration=0", "--states=" + states});
  EXPECT_EQ(report["steps"], 0);
  EXPECT_EQ(report["wall_ms_per_step"], 0);
  EXPECT_TRUE(report["cloths"][0]["samples"].empty());
  EXPECT_TRUE(ReadCsv(ReadText(states)).empty());
}

TEST_F(RunCommandTest, SetChangesEverySpec) {
  const std::string scene = Write("scene.json", kFreeFall);
  const std::string states = folder_ / "s.csv";
  RunForReport(scene, {"--set", "environment.gravity_m_per_s2=[0,-2,0]", "--set",
                       "material.damping_per_s=0", "--states=" + states});
  EXPECT_NEAR(ReadCsv(ReadText(states)).back()[4], -1.25 * 1.25, 1e-6);
  // Several values behind one --set, and the scene behind them.
  const Outcome outcome = Run({"--quiet", "--set", "settings.substeps=2",
                               "settings.max_iterations=3", "settings.time_step_s=0.65", scene});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

// The pin moves 1 m along x from the step at 0.5 s on, over 0.5 s; gravity turns at 1 s.
TEST_F(RunCommandTest, ControlsActAtTheirTimes) {
  const std::string scene = Write("scene.json", R"({
    "time_step_s": 0.25, "duration_s": 1.5,
    "cloths": [{"count": 2, "spacing_m": 10, "spec": {
      "particles": {"positions_m": [0,0,0, 5,0,0], "masses_kg": [1, 1]},
      "pins": [{"particle": 0}], "environment": {"gravity_m_per_s2": [0, 0, 0]}}}],
    "controls": [
      {"time_s": 0.4, "cloths": [1],
       "pin_targets": [{"particle": 0, "target_m": [1, 0, 0], "over_s": 0.5}]},
      {"time_s": 1, "gravity_m_per_s2": [0, 8, 0]}]})");
  const std::string states = folder_ / "s.csv";
  RunForReport(scene, {"--states=" + states});
  const auto rows = ReadCsv(ReadText(states));
  ASSERT_EQ(rows.size(), 6u * 2 * 2);
  const double pin_x[] = {0, 0, 0.5, 1, 1, 1};    // after each step
  const double free_y[] = {0, 0, 0, 0, 0.25, 1};  // 8 t^2 / 2 after 1 s
  for (size_t step = 0; step < 6; ++step) {
    EXPECT_NEAR(rows[4 * step][3], 0, 1e-6) << "cloth 0 is not controlled";
    EXPECT_NEAR(rows[4 * step + 2][3], 10 + pin_x[step], 1e-5) << step;
    EXPECT_NEAR(rows[4 * step + 1][4], free_y[step], 1e-6) << step;
    EXPECT_NEAR(rows[4 * step + 3][4], free_y[step], 1e-6) << step;
  }
}

// A particle is grabbed at the start, lifted from 0.5 s on over 0.5 s, and let go at 1 s.
TEST_F(RunCommandTest, GripsActAtTheirTimes) {
  const std::string scene = Write("scene.json", R"({
    "time_step_s": 0.25, "duration_s": 1.5,
    "cloths": [{"spec": {"max_grips": 1,
      "particles": {"positions_m": [0,0,0], "masses_kg": [1]}}}],
    "controls": [
      {"grips": [{"action": "GRAB_NEAREST", "target_m": [0, 0.1, 0], "radius_m": 0.2}]},
      {"time_s": 0.5, "grips": [{"action": "HOLD", "target_m": [0, 1.1, 0], "over_s": 0.5}]},
      {"time_s": 1, "grips": [{"action": "RELEASE"}]}]})");
  const std::string states = folder_ / "s.csv";
  RunForReport(scene, {"--states=" + states});
  const auto rows = ReadCsv(ReadText(states));
  ASSERT_EQ(rows.size(), 6u);
  const double g = 9.81;
  // It leaves with the 2 m/s of its motion.
  const double y[] = {0, 0, 0.5, 1, 1 + 2 * 0.25 - g * 0.03125, 1 + 2 * 0.5 - g * 0.125};
  for (size_t step = 0; step < 6; ++step) EXPECT_NEAR(rows[step][4], y[step], 1e-5) << step;
}

// A weightless sheet in calm air until 0.5 s, then carried along by wind, then stopped by wind from
// the other side: each time faster than half of it, because 0.5 s are many of its 1 / (c w).
// A ball on a thread of one metre, let go level, above a table: the thread carries 3 m g sin(a).
TEST_F(RunCommandTest, SamplesTellWhatPinsAndCollidersFeel) {
  const std::string scene = Write("pendulum.json", R"({
    "name": "pendulum", "time_step_s": 0.005, "duration_s": 0.65,
    "cloths": [{"spec": {
      "particles": {"positions_m": [0, 0, 0, 1, 0, 0], "masses_kg": [0.1, 2],
                    "distance_constraints": [{"i": 0, "j": 1}]},
      "pins": [{"particle": 0}],
      "environment": {
        "colliders": [{"plane": {"point_m": [0, -3, 0], "normal": [0, 1, 0]}}]}}}]})");
  const ordered_json report = RunForReport(scene, {});
  ASSERT_EQ(report["cloths"][0]["samples"].size(), 130u);
  std::vector<double> forces_n;
  for (const ordered_json& sample : report["cloths"][0]["samples"]) {
    ASSERT_EQ(sample["pins"].size(), 1u);
    EXPECT_EQ(sample["pins"][0]["particle"], 0);
    const auto impulse = sample["pins"][0]["impulse_n_s"].get<std::vector<double>>();
    ASSERT_EQ(impulse.size(), 3u);
    forces_n.push_back(std::hypot(impulse[0], impulse[1]) / 0.005);
    ASSERT_EQ(sample["colliders"].size(), 1u);
    const std::vector<double> nothing = {0, 0, 0};
    EXPECT_EQ(sample["colliders"][0]["impulse_n_s"].get<std::vector<double>>(), nothing);
    EXPECT_EQ(sample["colliders"][0]["angular_impulse_n_m_s"].get<std::vector<double>>(), nothing);
  }
  // It is lowest after a quarter of its period of 2.37 s, with the energy of its fall: what that is
  // off by, the force is. The swing lasts for 0.6 s, in which REALTIME may lose or gain 1 %. The
  // mean of nine steps, in which it turns by 5 degrees to either side (0.1 % of the force): in
  // each, the thread also makes up for the rounding of the ball's place.
  constexpr size_t kMean = 9;
  double largest_n = 0;
  for (size_t first = 0; first + kMean <= forces_n.size(); ++first) {
    const auto begin = forces_n.begin() + static_cast<std::ptrdiff_t>(first);
    const double sum_n = std::accumulate(begin, begin + kMean, 0.0);
    largest_n = std::max(largest_n, sum_n / kMean);
  }
  EXPECT_NEAR(largest_n, 3 * 2 * 9.81 + 0.1 * 9.81, 0.01 * 3 * 2 * 9.81);
  // Every backend tells them; each may be off by the 1 % of the motion.
  const ordered_json of_gl = RunForReport(scene, {"--every=130"}, "gl");
  const ordered_json& sample = of_gl["cloths"][0]["samples"].back();
  const ordered_json& wanted = report["cloths"][0]["samples"].back();
  ASSERT_TRUE(sample.contains("pins"));
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(sample["pins"][0]["impulse_n_s"][k].get<double>(),
                wanted["pins"][0]["impulse_n_s"][k].get<double>(), 0.02 * 0.005 * largest_n);
  }
}

TEST_F(RunCommandTest, TheWindOfAControlBlows) {
  const std::string scene = Write("scene.json", R"({
    "time_step_s": 0.25, "duration_s": 1.5,
    "cloths": [{"spec": {"grid": {"columns": 3, "rows": 3, "width_m": 1, "height_m": 1},
      "material": {"air_drag": 5}, "environment": {"gravity_m_per_s2": [0, 0, 0]}}}],
    "controls": [{"time_s": 0.5, "wind_m_per_s": [0, 3, 0]},
                 {"time_s": 1, "wind_m_per_s": [0, -3, 0], "gravity_m_per_s2": [0, 0, 0]}]})");
  const std::string states = folder_ / "s.csv";
  RunForReport(scene, {"--states=" + states});
  const auto rows = ReadCsv(ReadText(states));
  ASSERT_EQ(rows.size(), 6u * 9);
  const auto speed = [&](size_t step) {  // mean vy: single particles swing about it
    double sum = 0;
    for (size_t particle = 0; particle < 9; ++particle) sum += rows[9 * (step - 1) + particle][7];
    return sum / 9;
  };
  EXPECT_EQ(speed(2), 0);
  EXPECT_GT(speed(4), 1.5);
  EXPECT_LT(speed(4), 3);
  EXPECT_LT(speed(6), -1.5);
  EXPECT_GT(speed(6), -3);
}

// The second of three triangles has no area.
TEST_F(RunCommandTest, ReportsTrianglesThatWereLeftOut) {
  WriteText(folder_ / "m.obj",
            "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 2 0 0\nv 2 0 1\nf 1 2 3\nf 1 2 4\nf 2 4 5\n");
  WriteText(folder_ / "m.json",
            R"({"name": "m", "time_step_s": 0.01, "duration_s": 0.02,
                "cloths": [{"spec": {"mesh_file": "m.obj"}}]})");
  const auto report = RunForReport((folder_ / "m.json").string(), {});
  EXPECT_EQ(report["cloths"][0]["warnings"]["dropped_triangles"], 1);
}

TEST_F(RunCommandTest, TellsOfVerticesThatNoTriangleHas) {
  WriteText(folder_ / "m.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 2 0 0\nf 1 2 3\n");
  WriteText(folder_ / "m.json",
            R"({"name": "m", "time_step_s": 0.01, "duration_s": 0.02,
                "cloths": [{"spec": {"mesh_file": "m.obj"}}]})");
  const std::string path = folder_ / "r.json";
  const Outcome outcome = Run({(folder_ / "m.json").string(), "--report=" + path});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("(1 vertices of no triangle, which nothing holds)"));
  EXPECT_EQ(ordered_json::parse(ReadText(path))["cloths"][0]["mesh_repair"]["loose_vertices"], 1);
}

TEST_F(RunCommandTest, TellsHowMuchOfTheStiffnessActs) {
  WriteText(folder_ / "s.json",
            R"({"name": "s", "time_step_s": 0.01, "duration_s": 0.02,
                "cloths": [{"spec": {"grid": {"columns": 5, "rows": 5, "width_m": 0.01, "height_m": 0.01},
                                     "material": {"bending_stiffness_n_per_m": 0, "bending_rigidity_n_m": 1e-2},
                                     "settings": {"preset": "PAPER"}}}]})");
  const std::string path = folder_ / "r.json";
  const Outcome outcome = Run({(folder_ / "s.json").string(), "--report=" + path});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("elements of bending or shear are softer than requested"));
  const auto limit = ordered_json::parse(ReadText(path))["cloths"][0]["elastic_limit"];
  EXPECT_GT(limit["elements"], 0);
  EXPECT_LT(limit["least_share"], 1);
  EXPECT_THAT(
      outcome.out,
      HasSubstr(limit["enough_substeps"] == 0
                    ? std::string("no number of substeps would do")
                    : "settings.substeps " + std::to_string(limit["enough_substeps"].get<int>())));
}

TEST_F(RunCommandTest, AFaultedClothEndsARunWithItsOwnCode) {
  const std::string scene = Write("scene.json", client_test::SceneWithAFault());
  const std::string path = folder_ / "r.json";
  const Outcome outcome = Run({scene, "--json", "--report=" + path});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("springs: cloth 1 is faulted after step "),
                    HasSubstr("; the last good state is kept"), Not(HasSubstr("cloth 0"))));
  const auto report = ordered_json::parse(ReadText(path));
  EXPECT_EQ(report["steps"], 20) << "the other cloth goes on";
  EXPECT_EQ(report["cloths"][0]["faulted"], false);
  EXPECT_EQ(report["cloths"][0]["fault_reason"], "");
  EXPECT_EQ(report["cloths"][1]["faulted"], true);
  const std::string reason = report["cloths"][1]["fault_reason"];
  EXPECT_THAT(outcome.err, HasSubstr(reason));
  const auto printed = ordered_json::parse(outcome.out);
  EXPECT_EQ(printed["faulted"], 1);
  ASSERT_EQ(printed["faults"].size(), 1u);
  EXPECT_EQ(printed["faults"][0]["cloth"], 1);
  EXPECT_EQ(printed["faults"][0]["reason"], reason);
  EXPECT_GT(printed["faults"][0]["after_step"], 0);
  EXPECT_LT(printed["faults"][0]["after_step"], 10);

  const Outcome demo = RunProgram(
      "drape", {"demo", "--backend=cpu", "--scenes", scene, "--out=" + (folder_ / "out").string()});
  EXPECT_EQ(demo.exit_code, 3);
  EXPECT_THAT(demo.err, HasSubstr(reason));
}

TEST_F(RunCommandTest, ComparesTwoBackends) {
  const Outcome outcome =
      Run({Example("hanging_two_corners.json"), "--duration=0.1", "--compare=reference"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("largest position difference of cpu and reference: "));

  const Outcome json_outcome =
      Run({Example("hanging_two_corners.json"), "--duration=0.1", "--compare=reference", "--json"});
  const auto printed = nlohmann::json::parse(json_outcome.out);
  const double largest = printed["comparison"]["largest_position_difference_m"];
  // Single against double precision over 6 steps of 60 substeps: more than nothing, and far below a
  // millimetre (360 substeps of errors of a few ulp of 1 m, 6e-8 each, would be 1e-4 if all added).
  EXPECT_GT(largest, 0);
  EXPECT_LT(largest, 1e-3);
  EXPECT_EQ(printed["comparison"]["backend"], "reference");
  EXPECT_EQ(printed["comparison"]["compared_steps"], 6);
}

// The same request gives the same states, bit for bit: also in other pieces.
TEST_F(RunCommandTest, SamplingChangesNothing) {
  std::vector<std::string> last_rows;
  for (const char* every : {"--every=1", "--every=4", "--every=100"}) {
    const std::string states = folder_ / "s.csv";
    RunForReport(Example("sphere_drop.json"), {"--duration=0.15", every, "--states=" + states});
    const std::string text = ReadText(states);
    last_rows.push_back(text.substr(text.size() - std::min<size_t>(text.size(), 100'000)));
  }
  EXPECT_TRUE(last_rows[0] == last_rows[1]);
  EXPECT_TRUE(last_rows[0].ends_with(last_rows[2].substr(last_rows[2].find('\n') + 1)));
}

TEST_F(RunCommandTest, NoProgressBarInAPipe) {
  const Outcome outcome = Run({Write("scene.json", kFreeFall)});
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("free_fall: 5 steps of 3 cloths (12 particles) on cpu"),
                                 Not(HasSubstr("\r"))));
  EXPECT_EQ(Run({Write("scene.json", kFreeFall), "--quiet"}).out, "");
  EXPECT_THAT(Run({Write("scene.json", kFreeFall), "--quiet", "--summary"}).out,
              AllOf(HasSubstr("max strain"), HasSubstr("free_fall")));
}

struct BadCall {
  std::vector<std::string> arguments;
  int exit_code;
  std::string message;  // on stderr
};

TEST_F(RunCommandTest, ErrorsNameWhatIsWrong) {
  const std::string good = Write("good.json", kFreeFall);
  const auto scene = [this](const std::string& name, const std::string& spec) {
    return Write(name, R"({"duration_s": 1, "cloths": [{"spec": {)" + spec + "}}]}");
  };
  const std::string grid = R"("grid": {"columns": 2, "rows": 2, "width_m": 1, "height_m": 1})";
  const std::vector<BadCall> calls = {
      // The request fails: 1.
      {{"nowhere.json"}, 1, "nowhere.json"},
      {{scene("a.json", grid + R"(, "wobble": 1)")}, 1, "cloths[0].spec.wobble"},
      {{scene("b.json", R"("mesh_file": "gone.obj")")}, 1, "gone.obj"},
      {{scene("c.json", R"("particles": {"positions_m": [[0,0,0]], "masses_kg": [1]})")},
       1,
       "cloths[0].spec.particles.positions_m[0]"},
      {{scene("d.json", grid + R"(, "pins": [{"particle": 4}])")}, 1, "pins[0].particle"},
      {{scene("e.json", R"("grid": {"columns": 0, "rows": 2, "width_m": 1, "height_m": 1})")},
       1,
       "grid.columns"},
      {{scene("f.json", grid + R"(, "material": {"damping_per_s": "NaN"})")}, 1, "damping_per_s"},
      {{good, "--set", "settings.time_step_s=0"}, 1, "time_step_s"},
      {{good, "--set", "settings.substeps=0"}, 1, "substeps"},
      {{good, "--report=/nonexistent/r.json"}, 1, "/nonexistent/r.json"},
      {{good, "--states=/nonexistent/s.csv"}, 1, "/nonexistent/s.csv"},
      // Usage: 2.
      {{}, 2, "SCENE.json"},
      {{good, "--wobble"}, 2, "--wobble"},
      {{good, "--every=0"}, 2, "--every"},
      {{good, "--backend=abacus"}, 2, "--backend"},
      {{good, "--compare=abacus"}, 2, "--compare"},
      {{good, "--states=s.txt"}, 2, "s.txt"},
      {{good, "--duration=nan"}, 2, "--duration"},
      {{good, "--states=s.csv", "--report=./s.csv"}, 2, "--report"},
      {{good, "--set", "substeps"}, 2, "substeps"},
      {{good, "--server=127.0.0.1:1"}, 2, "--server"},
  };
  for (const BadCall& call : calls) {
    std::vector<std::string> arguments = {"run"};
    arguments.insert(arguments.end(), call.arguments.begin(), call.arguments.end());
    arguments.push_back("--backend=cpu");
    const Outcome outcome = RunProgram("drape", arguments);
    EXPECT_EQ(outcome.exit_code, call.exit_code) << call.message;
    EXPECT_THAT(outcome.err, HasSubstr(call.message));
    EXPECT_EQ(outcome.out, "");
  }
}

TEST_F(RunCommandTest, ARunThatFailsBeforeItsFirstSampleLeavesOlderFiles) {
  const std::string scene = Write("scene.json", R"({"duration_s": 1, "cloths": [{"spec": {
    "grid": {"columns": 2, "rows": 2, "width_m": 1, "height_m": 1}, "pins": [{"particle": 4}]}}]})");
  const std::string report = Write("r.json", "older report");
  const std::string states = Write("s.csv", "older states");
  EXPECT_EQ(Run({scene, "--report=" + report, "--states=" + states}).exit_code, 1);
  EXPECT_EQ(ReadText(report), "older report");
  EXPECT_EQ(ReadText(states), "older states");
}

TEST_F(RunCommandTest, AServerThatIsNotThereIsAClearError) {
  const Outcome outcome =
      RunProgram("drape", {"run", Write("scene.json", kFreeFall), "--server=nowhere.invalid:1"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("UNAVAILABLE"));
  EXPECT_THAT(outcome.err, HasSubstr("nowhere.invalid:1"));
}

}  // namespace
}  // namespace drape
