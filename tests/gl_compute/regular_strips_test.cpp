// Strips that are read without lists of their particles and rest lengths: which ones are, and that
// no bit depends on it, under any plan.
#include "server/solver/gl_compute/regular_strips.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "server/solver/gl_compute/kernel_variant.h"
#include "tests/gl_compute/test_cloths.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape {
namespace {

using testing::HasSubstr;

std::vector<RegularStrip> StripsOf(const ModelDescription& description) {
  return FindRegularStrips(*BuildModel(description));
}

// Five particles 0.02 m apart in a row, numbered as given.
ModelDescription NumberedChain(const std::vector<uint32_t>& numbers) {
  ModelDescription description = ChainDescription(5);
  auto& chain = std::get<ParticleTopology>(description.topology);
  const auto positions_m = chain.positions_m;
  for (size_t k = 0; k < numbers.size(); ++k) chain.positions_m[numbers[k]] = positions_m[k];
  for (DistanceConstraint& link : chain.distance_constraints) {
    link.i = numbers[link.i];
    link.j = numbers[link.j];
  }
  return description;
}

TEST(RegularStripsTest, RowsAndColumnsOfAGrid) {
  const auto model = GridModel(5, 3, {0, 7});
  const std::vector<RegularStrip> strips = FindRegularStrips(*model);
  ASSERT_EQ(strips.size(), 3u + 5u);
  const StripSet& lists = model->strips();
  for (uint32_t s = 0; s < strips.size(); ++s) {
    const RegularStrip& strip = strips[s];
    EXPECT_EQ(strip.link_begin, lists.strip_offsets[s]);
    EXPECT_EQ(strip.link_end, lists.strip_offsets[s + 1]);
    uint32_t particle = strip.first_particle;
    for (uint32_t k = strip.link_begin; k <= strip.link_end; ++k, particle += strip.stride) {
      EXPECT_EQ(particle, lists.particles[k + s]);
    }
    EXPECT_EQ(strip.rest_length_m, strip.link_end - strip.link_begin == 4 ? 0.25f : 0.5f);
  }
}

TEST(RegularStripsTest, AnyStrideWillDo) {
  EXPECT_EQ(StripsOf(NumberedChain({0, 1, 2, 3, 4})).size(), 1u);
  EXPECT_EQ(StripsOf(NumberedChain({4, 3, 2, 1, 0})).size(), 1u);
  EXPECT_EQ(StripsOf(NumberedChain({0, 2, 1, 3, 4})).size(), 0u);
  EXPECT_EQ(StripsOf(NumberedChain({0, 1, 2, 4, 3})).size(), 0u);
}

// Strips without any links do not make a model regular.
TEST(RegularStripsTest, NothingToFind) {
  ModelDescription loose = ChainDescription(3);
  std::get<ParticleTopology>(loose.topology).distance_constraints.clear();
  EXPECT_EQ(StripsOf(loose).size(), 0u);
}

// Lengths are compared as the kernels read them; one other link is enough for lists.
TEST(RegularStripsTest, EquallyLongInSinglePrecision) {
  for (const uint32_t link : {0u, 2u, 3u}) {
    ModelDescription description = ChainDescription(5);
    auto& links = std::get<ParticleTopology>(description.topology).distance_constraints;
    links[link].rest_length_m *= 1 + 1e-12;
    EXPECT_EQ(StripsOf(description).size(), 1u) << link;
    links[link].rest_length_m = std::nextafter(0.02f, 1.0f);
    EXPECT_EQ(StripsOf(description).size(), 0u) << link;
  }
}

TEST(RegularStripsTest, OfCloths) {
  const auto is_chosen = [](const test::Scene& scene, bool finds = true, bool own_lengths = false) {
    const DeviceTraits device{.loop_budget = 1u << 24, .finds_regular_strips = finds};
    const LengthSource lengths = own_lengths ? LengthSource::kOwn : LengthSource::kModel;
    const auto choice =
        ChooseVariant(PlanOnDevice(*scene.model, scene.parameters, lengths), device);
    DRAPE_CHECK(choice.ok(), choice.status().ToString());
    const bool is_defined =
        choice->variant.Defines().find("HAS_REGULAR_STRIPS") != std::string::npos;
    EXPECT_EQ(choice->variant.Has(Feature::kRegularStrips), is_defined);
    return is_defined;
  };
  test::Scene sheet = test::Grid(8, 8, 1, 1, {0});
  EXPECT_TRUE(is_chosen(sheet));
  EXPECT_TRUE(is_chosen(test::Grid(33, 32, 1, 1, {0}))) << "tiled";
  EXPECT_TRUE(is_chosen(test::CompliantSheet(8, 1e-5)));
  EXPECT_FALSE(is_chosen(sheet, false)) << "not wanted";
  EXPECT_FALSE(is_chosen(sheet, true, true)) << "driven lengths have no strips";
  test::Scene chain = sheet;
  chain.model = BuildModel(NumberedChain({0, 2, 1, 3, 4}));
  EXPECT_FALSE(is_chosen(chain)) << "numbered as it comes";
  sheet.parameters.settings.sweep = Sweep::kColours;
  EXPECT_FALSE(is_chosen(sheet));
}

// How the steps of a test are computed.
struct StripWay {
  std::string name;
  bool is_tiled = false;
  GlTuning tuning{};
};

std::vector<StripWay> PlainWays() {
  constexpr auto kElimination = StripSolve::kElimination;
  return {{.name = "resident", .tuning = {.strip_solve = kElimination}},
          {.name = "tiled", .is_tiled = true, .tuning = {.strip_solve = kElimination}}};
}

// Each has kernels of its own, which take seconds to compile.
std::vector<StripWay> OtherWays() {
  constexpr auto kLanes = StripSolve::kReductionWithBarriers;
  constexpr auto kElimination = StripSolve::kElimination;
  return {{.name = "in_parts", .tuning = {.loop_budget = 1500, .strip_solve = kElimination}},
          {.name = "reduction", .tuning = {.strip_solve = kLanes}},
          {.name = "reduction_in_parts", .tuning = {.loop_budget = 1500, .strip_solve = kLanes}}};
}

// Sheets that are thrown about, each with strips of another kind.
std::vector<test::Scene> Sheets(uint32_t columns, uint32_t rows) {
  std::vector<test::Scene> scenes;
  const auto add = [&](const std::string& name, const StructuralMaterial& material,
                       const auto& change) {
    // Wider than high, so that rows and columns have other lengths; not held along the last row.
    test::Scene scene = test::Grid(columns, rows, 1.5, 1, {0, columns / 2, columns - 1}, material);
    scene.name = name;
    scene.parameters.settings.substeps = 12;
    test::Stir(scene, 2);
    change(scene.parameters);
    scenes.push_back(std::move(scene));
  };
  add("realtime", {}, [](ClothParameters&) {});
  add("start_directions_of_several_sweeps", {}, [](ClothParameters& parameters) {
    parameters.settings.integration = Integration::kOneStep;
    parameters.settings.direction = Direction::kAtStart;
    parameters.settings.max_iterations = 3;
  });
  add("compliance_of_several_sweeps", {.stretch_compliance_m_per_n = 1e-4},
      [](ClothParameters& parameters) { parameters.settings.max_iterations = 3; });
  add("tolerance", {}, [](ClothParameters& parameters) {
    parameters.settings.tolerance = 1e-3;
    parameters.settings.max_iterations = 8;
  });
  // Farther from its lengths than one sweep's impulses may move it.
  add("torn", {}, [](ClothParameters& parameters) { parameters.settings.substeps = 2; });
  for (size_t i = columns; i < scenes.back().state.positions_m.size(); ++i) {
    scenes.back().state.positions_m[i] *= 3;
  }
  return scenes;
}

struct PlayedSheet {
  std::string bits;
  bool has_moved = false;
  uint32_t dispatch_count = 0;  // of the last step
};

PlayedSheet Play(Backend& backend, const test::Scene& scene) {
  const ClothHandle cloth = test::CreateCloth(backend, scene);
  const std::string start = test::ReadBits(backend, cloth);
  const StepItem item{.cloth = cloth, .pin_targets_m = {}, .measure = false};
  PlayedSheet played;
  for (int k = 0; k < 2; ++k) {
    const BatchReport report = backend.Step({&item, 1});
    EXPECT_EQ(report.reports.at(0).fault, FaultReason::kNone) << scene.name;
    played.dispatch_count = report.dispatch_count;
  }
  played.bits = test::ReadBits(backend, cloth);
  played.has_moved = played.bits != start;
  backend.Destroy(cloth);
  return played;
}

class RegularStripsBitsTest : public testing::TestWithParam<StripWay> {};
std::string NameOfWay(const testing::TestParamInfo<StripWay>& info) {
  return info.param.name;
}
INSTANTIATE_TEST_SUITE_P(Plain, RegularStripsBitsTest, testing::ValuesIn(PlainWays()), NameOfWay);
INSTANTIATE_TEST_SUITE_P(OthersLong, RegularStripsBitsTest, testing::ValuesIn(OtherWays()),
                         NameOfWay);

TEST_P(RegularStripsBitsTest, AreThoseOfLists) {
  StripWay way = GetParam();
  const auto regular = MakeGlBackend(way.tuning);
  way.tuning.find_regular_strips = false;
  const auto by_lists = MakeGlBackend(way.tuning);
  for (const test::Scene& scene : way.is_tiled ? Sheets(33, 32) : Sheets(9, 8)) {
    ASSERT_FALSE(FindRegularStrips(*scene.model).empty());
    const PlayedSheet played = Play(*regular, scene);
    EXPECT_TRUE(played.bits == Play(*by_lists, scene).bits) << scene.name;
    EXPECT_TRUE(played.has_moved) << scene.name;
    if (way.tuning.loop_budget != 0 && scene.parameters.settings.substeps > 2) {
      EXPECT_GT(played.dispatch_count, 1u) << scene.name;
    }
  }
}

// Numbers that go down.
TEST(RegularStripsTest, StridesBelowZero) {
  const auto regular = MakeGlBackend();
  const auto by_lists = MakeGlBackend({.find_regular_strips = false});
  const auto model = BuildModel(NumberedChain({4, 3, 2, 1, 0}));
  test::Scene chain{.name = "down",
                    .model = model,
                    .parameters = test::PlainParameters(),
                    .state = AtRest(*model),
                    .pin_targets_m = {}};
  test::Stir(chain, 1);
  const PlayedSheet played = Play(*regular, chain);
  EXPECT_TRUE(played.has_moved);
  EXPECT_TRUE(played.bits == Play(*by_lists, chain).bits);
}

// The option reaches the kernels.
TEST(RegularStripsTest, KernelsAreToldWhichItIs) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "told_strips";
  std::filesystem::create_directories(folder / "stages");
  std::ofstream(folder / "stages" / "solve_strips.glsl")
      << "#ifdef HAS_REGULAR_STRIPS\n#error told of none but regular ones\n#else\n"
         "#error told of lists\n#endif\n";
  for (const bool is_tiled : {false, true}) {
    const auto model = is_tiled ? GridModel(33, 32) : GridModel(4, 4);
    for (const bool finds : {true, false}) {
      const auto backend =
          MakeGlBackend({.find_regular_strips = finds}, {.shader_dir = folder.string()});
      const auto refused = backend->Create(model, test::PlainParameters(), AtRest(*model));
      ASSERT_FALSE(refused.ok());
      EXPECT_THAT(refused.status().message(),
                  HasSubstr(finds ? "told of none but regular ones" : "told of lists"));
    }
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace drape
