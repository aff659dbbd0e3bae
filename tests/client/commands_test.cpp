// The commands that talk to a running server, end to end.
#include "client/cli/commands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "drape/client.h"
#include "tests/client/client_test_support.h"

namespace drape {
namespace {

using client_test::Example;
using client_test::Outcome;
using client_test::ProgramPath;
using client_test::ReadText;
using client_test::RunningProgram;
using client_test::RunProgram;
using client_test::TemporaryFolder;
using client_test::WriteText;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

class CommandsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    SpawnOptions options;
    options.backend = "cpu";
    options.executable = ProgramPath("draped");
    client_ = new Client(Client::SpawnServer(options));
  }
  static void TearDownTestSuite() {
    delete client_;
    client_ = nullptr;
  }

  static std::vector<std::string> OnServer(std::vector<std::string> arguments) {
    arguments.push_back("--server=" + client_->address());
    return arguments;
  }
  // A command that must succeed; returns its output.
  static std::string Do(std::vector<std::string> arguments) {
    const Outcome outcome = RunProgram("drape", OnServer(std::move(arguments)));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  }
  static json DoJson(std::vector<std::string> arguments) {
    arguments.push_back("--json");
    return json::parse(Do(std::move(arguments)));
  }
  static std::string CreateChain() {
    return DoJson({"create", Example("chain.json"), "--ttl=60"})["session"];
  }

  static Client* client_;
};

Client* CommandsTest::client_ = nullptr;

TEST_F(CommandsTest, InfoAndHealth) {
  EXPECT_THAT(Do({"info"}), AllOf(HasSubstr(client_->address()), HasSubstr("cpu (float32)"),
                                  HasSubstr("max_steps_per_request")));
  EXPECT_EQ(DoJson({"info"})["precision"], "float32");
  EXPECT_EQ(Do({"health"}), "SERVING\n");
  EXPECT_EQ(DoJson({"health"})["status"], "SERVING");
}

TEST_F(CommandsTest, InfoWithoutAServerStartsOne) {
  const Outcome outcome = RunProgram("drape", {"info", "--backend=reference", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["backend"], "reference");
}

TEST_F(CommandsTest, CreateStepReadDelete) {
  const json created = DoJson({"create", Example("sphere_drop.json")});
  const std::string session = "--session=" + created["session"].get<std::string>();
  ASSERT_EQ(created["cloths"].size(), 2u);
  EXPECT_EQ(created["cloths"][0]["particles"], 1024);
  const std::string second = created["cloths"][1]["id"];

  const json stepped = DoJson({"step", session, "--steps=2", "--report"});
  EXPECT_EQ(stepped["reports"].size(), 2u);
  EXPECT_EQ(stepped["reports"][1]["cloth_id"], second);
  EXPECT_THAT(Do({"step", session, "--cloth=" + second, "--until=5"}), HasSubstr("step 5"));

  const json read = DoJson({"read", session});
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0]["step"], 2);
  EXPECT_EQ(read[1]["step"], 5);
  EXPECT_EQ(read[1]["positions_m"].size(), 3u * 1024);
  EXPECT_EQ(read[1]["velocities_m_per_s"].size(), 3u * 1024);
  const TemporaryFolder folder;
  Do({"read", session, "--cloth=" + second, "--states=" + (folder / "s.csv").string()});
  EXPECT_THAT(ReadText(folder / "s.csv"), HasSubstr("\n0.0833333333,0,1023,"));
  const json corners = DoJson({"read", session, "--particles=0,31,1023"});
  EXPECT_EQ(corners[1]["particles"], json({0, 31, 1023}));
  ASSERT_EQ(corners[1]["positions_m"].size(), 9u);
  for (size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(corners[1]["positions_m"][3 + axis], read[1]["positions_m"][3 * 31 + axis]);
    EXPECT_EQ(corners[1]["velocities_m_per_s"][6 + axis],
              read[1]["velocities_m_per_s"][3 * 1023 + axis]);
  }
  EXPECT_THAT(Do({"read", session, "--particles=0,31"}),
              AllOf(HasSubstr("2 particles"), HasSubstr("\n    31  "), Not(HasSubstr("1024"))));
  Do({"read", session, "--particles=31", "--states=" + (folder / "p.csv").string()});
  EXPECT_THAT(ReadText(folder / "p.csv"), HasSubstr("\n0.0833333333,1,31,"));

  const json cloths = DoJson({"list", session});
  ASSERT_EQ(cloths.size(), 2u);
  EXPECT_EQ(cloths[1]["id"], second);
  EXPECT_THAT(Do({"list", session}), HasSubstr("1024 particles"));
  Do({"delete", session, "--cloth=" + second});
  EXPECT_EQ(DoJson({"list", session}).size(), 1u);
  Do({"delete", session});
  const Outcome gone = RunProgram("drape", OnServer({"list", session}));
  EXPECT_EQ(gone.exit_code, 1);
  EXPECT_THAT(gone.err, HasSubstr("NOT_FOUND"));
}

TEST_F(CommandsTest, AFaultedClothEndsAStepWithItsOwnCode) {
  const TemporaryFolder folder;
  WriteText(folder / "scene.json", client_test::SceneWithAFault());
  const json created = DoJson({"create", folder / "scene.json"});
  const std::string session = "--session=" + created["session"].get<std::string>();
  const std::string first = "cloth " + created["cloths"][0]["id"].get<std::string>();
  const std::string second = "cloth " + created["cloths"][1]["id"].get<std::string>();
  const auto step = [&](const std::string& flag) {
    const Outcome outcome = RunProgram("drape", OnServer({"step", session, flag}));
    EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
    return outcome.out;
  };
  EXPECT_THAT(step("--steps=10"), AllOf(HasSubstr(first + ": step 10\n"),
                                        HasSubstr(second + ": step "), HasSubstr(", FAULTED\n")));
  EXPECT_THAT(step("--report"), HasSubstr(", FAULTED: "));
  EXPECT_EQ(json::parse(step("--json"))["faulted_cloth_ids"].size(), 1u);
  Do({"delete", session});
}

TEST_F(CommandsTest, ListTellsSessionsButNotTheirSecret) {
  const std::string session = CreateChain();
  const std::string out = Do({"list"});
  EXPECT_THAT(out, HasSubstr("drape create"));
  EXPECT_THAT(out, HasSubstr("41 particles"));
  EXPECT_EQ(out.find(session), std::string::npos);
  Do({"delete", "--session=" + session});
}

TEST_F(CommandsTest, ASnapshotIsRestored) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "cloths.snapshot").string();
  Session session = client_->CreateSession();
  v1::ClothSpec spec;
  spec.mutable_grid()->set_columns(4);
  spec.mutable_grid()->set_rows(4);
  spec.mutable_grid()->set_width_m(1);
  spec.mutable_grid()->set_height_m(1);
  spec.add_pins()->set_particle(0);
  const ClothId id = session.CreateCloth(spec);
  session.Step(4);
  EXPECT_THAT(Do({"snapshot", file, "--session=" + session.name()}), HasSubstr(" bytes"));
  const std::string out = Do({"restore", file, "--ttl=60"});
  EXPECT_THAT(out, HasSubstr("formerly " + std::to_string(id)));
  const std::string name = out.substr(8, out.find('\n') - 8);
  Session restored = client_->AttachSession(name);
  session.Step(3);
  restored.Step(3);
  const States expected = session.ReadStates(), actual = restored.ReadStates();
  ASSERT_EQ(actual.size(), 1u);
  EXPECT_TRUE(std::ranges::equal(actual[0].positions_m.floats(), expected[0].positions_m.floats()));
  EXPECT_EQ(actual[0].step, 7u);
  restored.Delete();
  WriteText(folder.path() / "cloths.snapshot", "DRAPESNP and no more");
  const Outcome damaged = RunProgram("drape", OnServer({"restore", file}));
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_THAT(damaged.err, HasSubstr("SNAPSHOT_DAMAGED"));
}

TEST_F(CommandsTest, CreateAddsToASession) {
  const std::string session = CreateChain();
  DoJson({"create", Example("net.json"), "--session=" + session, "--set",
          "material.damping_per_s=0.1"});
  EXPECT_EQ(DoJson({"list", "--session=" + session}).size(), 2u);
  Do({"delete", "--session=" + session});
}

// The server refuses the second entry: the session has the same cloths as before.
TEST_F(CommandsTest, CreateAddsAllOrNothing) {
  const std::string session = CreateChain();
  const TemporaryFolder folder;
  constexpr char kGrid[] = R"("grid": {"columns": 2, "rows": 2, "width_m": 1, "height_m": 1})";
  WriteText(folder / "bad.json", R"({"cloths": [{"count": 3, "spec": {)" + std::string(kGrid) +
                                     R"(}}, {"spec": {)" + kGrid +
                                     R"(, "pins": [{"particle": 99}]}}]})");
  const Outcome outcome =
      RunProgram("drape", OnServer({"create", folder / "bad.json", "--session=" + session}));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("): cloths[1].spec.pins[0].particle: "));
  EXPECT_EQ(DoJson({"list", "--session=" + session}).size(), 1u);
  Do({"delete", "--session=" + session});
}

TEST_F(CommandsTest, WatchFollows) {
  const std::string session = CreateChain();
  RunningProgram watch("drape",
                       OnServer({"watch", "--session=" + session, "--frames=3", "--json"}));
  Session attached = client_->AttachSession(session);
  // Until the watcher has seen enough: how much it misses depends on both.
  std::atomic<bool> is_done = false;
  std::thread stepper([&] {
    while (!is_done) {
      attached.Step(1);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  const Outcome outcome = watch.Wait();
  is_done = true;
  stepper.join();
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(outcome.out);
  uint64_t last_step = 0;
  int frames = 0;
  for (std::string line; std::getline(lines, line); ++frames) {
    const json frame = json::parse(line);
    EXPECT_EQ(frame["cloths"], 1);
    EXPECT_GT(frame["step"].get<uint64_t>(), last_step);
    last_step = frame["step"];
  }
  EXPECT_EQ(frames, 3);
  attached.Delete();
}

TEST_F(CommandsTest, WatchMissesNoStepOfARun) {
  const std::string session = CreateChain();
  RunningProgram watch("drape", OnServer({"watch", "--session=" + session, "--every-frame",
                                          "--frames=12", "--json"}));
  std::atomic<bool> is_done = false;
  int runs = 0;
  std::thread stepper([&] {
    do {
      const Outcome run = RunProgram(
          "drape", OnServer({"step", "--session=" + session, "--hz=1000", "--steps=20"}));
      EXPECT_EQ(run.exit_code, 0) << run.err;
      EXPECT_THAT(run.out, HasSubstr("20 steps, 0 behind"));
      ++runs;
    } while (!is_done);
  });
  const Outcome outcome = watch.Wait();
  is_done = true;
  stepper.join();
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(outcome.out);
  std::vector<uint64_t> steps;
  for (std::string line; std::getline(lines, line);) steps.push_back(json::parse(line)["step"]);
  ASSERT_EQ(steps.size(), 12u);
  for (size_t k = 0; k < steps.size(); ++k) EXPECT_EQ(steps[k], steps[0] + k);
  Session attached = client_->AttachSession(session);
  EXPECT_EQ(attached.ListCloths()[0].step(), 20u * static_cast<uint64_t>(runs));
  attached.Delete();
}

TEST_F(CommandsTest, EveryCommandHasHelpAndUsageErrors) {
  for (const char* command : {"run", "demo", "info", "health", "create", "step", "read", "render",
                              "watch", "list", "delete"}) {
    const Outcome help = RunProgram("drape", {command, "--help"});
    EXPECT_EQ(help.exit_code, 0) << command;
    EXPECT_THAT(help.out, AllOf(HasSubstr("--server"), HasSubstr("Exit codes")));
    EXPECT_EQ(RunProgram("drape", {command, "--wobble"}).exit_code, 2) << command;
  }
  EXPECT_EQ(RunProgram("drape", {}).exit_code, 2);
  const Outcome unknown = RunProgram("drape", {"wobble"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, AllOf(HasSubstr("unknown command \"wobble\""), HasSubstr("run, demo")));
  EXPECT_EQ(RunProgram("drape", {"step", "--session=s"}).exit_code, 2) << "--server is required";
  EXPECT_EQ(RunProgram("drape", {"info", "--server=127.0.0.1:1", "--tries=0"}).exit_code, 2);
  EXPECT_EQ(RunProgram("drape", {"info", "--tries=1"}).exit_code, 2) << "of a private server";
  const Outcome lacking = RunProgram("drape", {"info", "--server=", "--tries=1"});
  EXPECT_EQ(lacking.exit_code, 2);
  EXPECT_THAT(lacking.err, HasSubstr("--server= has no value"));
}

TEST_F(CommandsTest, DemoPrintsATableAndNamesItsFiles) {
  const TemporaryFolder folder;
  const std::string out = folder / "out";
  const std::string text = Do({"demo", "--scenes", Example("chain.json"), Example("mesh_drop.json"),
                               "--out=" + out, "--duration=0.1"});
  EXPECT_THAT(text, AllOf(HasSubstr("particles"), HasSubstr("constraints"), HasSubstr("colours"),
                          HasSubstr("ms per step"), HasSubstr("real time"), HasSubstr("max strain"),
                          HasSubstr("RMS strain"), HasSubstr("contacts")));
  for (const char* name :
       {"chain.obj", "chain.ply", "chain.png", "mesh_drop.obj", "mesh_drop.ply", "mesh_drop.png"}) {
    const fs::path path = fs::path(out) / name;
    EXPECT_THAT(text, HasSubstr(path.string()));
    EXPECT_GT(fs::file_size(path), 1000u);
  }
  EXPECT_THAT(ReadText(fs::path(out) / "chain.obj"), HasSubstr("\nl 40 41\n"));
}

// The cores of the machine step what the kernels cannot: a world, and a body.
TEST_F(CommandsTest, DemoPlaysEverythingOnGl) {
  const TemporaryFolder folder;
  const Outcome outcome =
      RunProgram("drape", {"demo", "--backend=gl", "--scenes", Example("chain.json"),
                           Example("five_sheets.json"), Example("hammock.json"),
                           "--out=" + (folder / "out").string(), "--duration=0.05"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("backend gl on"), HasSubstr("chain.obj"),
                                 HasSubstr("five_sheets.obj"), HasSubstr("hammock.obj")));
}

}  // namespace
}  // namespace drape
