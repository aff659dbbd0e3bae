// Pictures: `drape run --render`, `drape render`, the demo's, and servers that cannot draw.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "client/cli/picture_sink.h"
#include "drape/client.h"
#include "tests/client/client_test_support.h"
#include "tests/support/png/png_image.h"

namespace drape {
namespace {

using client_test::ErrorOf;
using client_test::Example;
using client_test::Outcome;
using client_test::ProgramPath;
using client_test::ReadText;
using client_test::RunProgram;
using client_test::TemporaryFolder;
using test::DecodePng;
using test::PngImage;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

// Hides EGL from draped, which inherits this environment.
class NoEgl {
 public:
  NoEgl() { setenv(kName, "/dev/null", 1); }
  ~NoEgl() { unsetenv(kName); }
  NoEgl(const NoEgl&) = delete;
  NoEgl& operator=(const NoEgl&) = delete;

 private:
  static constexpr char kName[] = "__EGL_VENDOR_LIBRARY_FILENAMES";
};

class RenderTest : public ::testing::Test {
 protected:
  // Plays the chain for a second: 60 steps.
  Outcome Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(),
                     {"run", Example("chain.json"), "--backend=cpu", "--duration=1"});
    return RunProgram("drape", arguments);
  }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  PngImage Image(const std::string& name) const { return DecodePng(ReadText(folder_ / name)); }
  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(fs::path(Path("")))) {
      names.push_back(entry.path().filename());
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  TemporaryFolder folder_;
};

TEST_F(RenderTest, WithoutEveryThereIsOnePictureOfTheLastStep) {
  const Outcome outcome = Run({"--render=" + Path("p.png")});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(Files(), ElementsAre("p.png"));
  EXPECT_EQ(Image("p.png").width_px, 960u);
  EXPECT_EQ(Image("p.png").height_px, 720u);
}

TEST_F(RenderTest, EveryGivesANumberedSeriesWithTheLastStep) {
  const Outcome outcome =
      Run({"--render=" + Path("p.png"), "--every=25", "--render-size=200x100", "--colour-by=speed",
           "--colour-range=0,3", "--view=0,-1,-1", "--no-legend"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(Files(), ElementsAre("p_000025.png", "p_000050.png", "p_000060.png"));
  EXPECT_EQ(Image("p_000025.png").width_px, 200u);
  EXPECT_EQ(Image("p_000025.png").height_px, 100u);
  EXPECT_GT(DifferentShare(Image("p_000025.png"), Image("p_000060.png")), 0) << "it moves";
}

// The last step of each sample is asked for them.
TEST_F(RenderTest, ContactsAreAskedForWhereTheyAreDrawn) {
  const Outcome outcome = Run({"--render=" + Path("p.png"), "--every=40", "--render-size=200x100",
                               "--colour-by=contact", "--colour-range=0,0.01"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(Files(), ElementsAre("p_000040.png", "p_000060.png"));
}

TEST_F(RenderTest, ASeriesOnlyWidensItsView) {
  SpawnOptions options;
  options.backend = "cpu";
  options.executable = ProgramPath("draped");
  const Client client = Client::SpawnServer(options);
  Session session = client.CreateSession();
  v1::ClothSpec spec;
  spec.mutable_grid()->set_columns(4);
  spec.mutable_grid()->set_rows(4);
  spec.mutable_grid()->set_width_m(1);
  spec.mutable_grid()->set_height_m(1);
  session.CreateCloth(spec);
  v1::RenderRequest request;
  request.set_all_cloths(true);
  const v1::RenderResponse first = session.Render(request);
  session.Step(60);  // falls some 5 m
  cli::IncludeView(first, request);
  const v1::RenderResponse second = session.Render(request);
  EXPECT_LT(second.bounds_m(1), -4);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LE(second.bounds_m(axis), first.bounds_m(axis) + 1e-6);
    EXPECT_GE(second.bounds_m(3 + axis), first.bounds_m(3 + axis) - 1e-6);
  }
  EXPECT_EQ(second.png().substr(1, 3), "PNG");
  const ErrorDetails error = ErrorOf([&] {
    v1::RenderRequest bad;
    bad.set_width_px(1);
    session.Render(bad);
  });
  EXPECT_EQ(error.violations.at(0).field, "width_px");
}

TEST_F(RenderTest, BadFlagsAreUsageErrors) {
  const std::string path = "--render=" + Path("p.png");
  for (const std::vector<std::string>& flags :
       std::vector<std::vector<std::string>>{{"--render=" + Path("p.jpg")},
                                             {"--render-size=100x100"},  // of nothing
                                             {path, "--render-size=100"},
                                             {path, "--render-size=15x100"},
                                             {path, "--render-size=100x4097"},
                                             {path, "--render-size=100x-1"},
                                             {path, "--colour-by=mood"},
                                             {path, "--camera=1,2,3"},
                                             {path, "--camera=1,2,3,4,5,nan"},
                                             {path, "--camera=1,2,3,4,5,6", "--view=1,2,3"},
                                             {path, "--colour-range=1"},
                                             {path, "--report=" + Path("p.png")}}) {
    const Outcome outcome = Run(flags);
    EXPECT_EQ(outcome.exit_code, 2) << flags.back() << outcome.err;
  }
  EXPECT_TRUE(Files().empty());
}

// A path that cannot be written and a camera that sees nothing do not cost a run.
TEST_F(RenderTest, WhatCannotBeDrawnIsRefusedBeforeTheRun) {
  const std::string report = "--report=" + Path("r.json");
  Outcome outcome = Run({"--render=" + Path("none/p.png"), report});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("CANNOT_WRITE"));
  outcome = Run({"--render=" + Path("p.png"), "--camera=1,2,3,1,2,3", report});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("camera.target_m"));
  EXPECT_TRUE(Files().empty());
}

TEST_F(RenderTest, PicturesOfALivingSession) {
  SpawnOptions options;
  options.backend = "cpu";
  options.executable = ProgramPath("draped");
  const Client client = Client::SpawnServer(options);
  Session session = client.CreateSession();
  v1::ClothSpec spec;
  spec.mutable_grid()->set_columns(4);
  spec.mutable_grid()->set_rows(4);
  spec.mutable_grid()->set_width_m(1);
  spec.mutable_grid()->set_height_m(1);
  const std::vector<ClothId> ids = session.CreateCloths(spec, 2);
  const auto render = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"render", "--server=" + client.address(),
                                         "--session=" + session.name(), Path("out.png")});
    return RunProgram("drape", arguments);
  };
  Outcome outcome = render({"--render-size=64x48"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("out.png: 64 x 48 px, 2 cloths, drawn by "));
  EXPECT_EQ(Image("out.png").width_px, 64u);
  outcome = render({"--cloth=" + std::to_string(ids[1]), "--colour-by=strain", "--json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto printed = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(printed["cloth_ids"].size(), 1u);
  EXPECT_FALSE(printed.contains("png")) << "that is in the file";
  EXPECT_EQ(printed["range"].size(), 2u);
  EXPECT_EQ(printed["camera"]["eye_m"].size(), 3u);
  outcome = render({"--cloth=1"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("CLOTH_NOT_FOUND"));
  EXPECT_THAT(Files(), ElementsAre("out.png")) << "the older one stays, and nothing beside it";
}

TEST_F(RenderTest, WithoutAnEglDeviceARunWithPicturesFailsAndTheDemoDoesWithout) {
  const NoEgl no_egl;
  Outcome outcome = Run({"--render=" + Path("p.png")});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("NO_EGL_DEVICE"));
  outcome = RunProgram("drape", {"demo", "--backend=cpu", "--scenes", Example("chain.json"),
                                 "--duration=0.1", "--out=" + Path("demo")});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("NO PICTURES: FAILED_PRECONDITION (NO_EGL_DEVICE)"));
  EXPECT_THAT(outcome.out, Not(HasSubstr(".png\n")));
  EXPECT_TRUE(fs::exists(folder_ / "demo/chain.obj"));
  EXPECT_FALSE(fs::exists(folder_ / "demo/chain.png"));
}

}  // namespace
}  // namespace drape
