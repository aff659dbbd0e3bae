// Strips by cyclic reduction: properties of this backend only. tests/parity/strips_test.cpp tests
// the results.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "server/gl/context.h"
#include "tests/gl_compute/test_cloths.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

// A sheet that is thrown about: its bits after two steps.
std::vector<float> ThrownSheet(Backend& backend, uint32_t columns, uint32_t rows,
                               Direction direction = Direction::kAtEnd) {
  const auto model = GridModel(columns, rows, {0, columns / 2, columns - 1});
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.integration = Integration::kOneStep;
  parameters.settings.direction = direction;
  parameters.settings.substeps = 4;
  parameters.settings.max_iterations = 3;
  ParticleState state = AtRest(*model);
  for (uint32_t i = columns; i < columns * rows; ++i) {
    state.velocities_m_per_s[i] = {std::cos(2.4 * i), 3 * std::sin(7.2 * i), std::sin(2.4 * i)};
  }
  const ClothHandle cloth = CreateCloth(backend, model, parameters, state);
  StepCloth(backend, cloth);
  EXPECT_EQ(StepCloth(backend, cloth).iterations, 4u * 3);
  std::vector<float> result = ReadCloth(backend, cloth);
  backend.Destroy(cloth);
  return result;
}

TEST(StripReductionLong, LocalSizeAndPartsDoNotChangeBits) {
  constexpr auto kWithBarriers = StripSolve::kReductionWithBarriers;
  const std::unique_ptr<Backend> usual = MakeGlBackend({.strip_solve = kWithBarriers});
  const std::unique_ptr<Backend> by_elimination =
      MakeGlBackend({.strip_solve = StripSolve::kElimination});
  std::vector<std::unique_ptr<Backend>> others;
  for (const uint32_t local_size : {8u, 64u, 128u, 256u}) {
    others.push_back(MakeGlBackend({.local_size = local_size, .strip_solve = kWithBarriers}));
  }
  others.push_back(MakeGlBackend({.loop_budget = 6000, .strip_solve = kWithBarriers}));
  for (const uint32_t side : {5u, 32u}) {
    for (const Direction direction : {Direction::kAtEnd, Direction::kAtStart}) {
      const std::vector<float> expected = ThrownSheet(*usual, side, side, direction);
      EXPECT_NE(ThrownSheet(*by_elimination, side, side, direction), expected)
          << "not by reduction";
      for (const auto& other : others) {
        EXPECT_EQ(ThrownSheet(*other, side, side, direction), expected) << side;
      }
    }
  }
}

// Strips of 33 particles and cloths of the tiled plan are solved from both ends.
TEST(StripReductionTest, LongStripsAreSolvedFromBothEnds) {
  const std::unique_ptr<Backend> reduction =
      MakeGlBackend({.strip_solve = StripSolve::kReductionWithBarriers});
  const std::unique_ptr<Backend> both_ends =
      MakeGlBackend({.strip_solve = StripSolve::kFromBothEnds});
  EXPECT_NE(ThrownSheet(*reduction, 15, 8), ThrownSheet(*both_ends, 15, 8)) << "15 particles";
  EXPECT_NE(ThrownSheet(*reduction, 32, 17), ThrownSheet(*both_ends, 32, 17)) << "quads";
  for (const uint32_t rows : {7u, 17u}) {
    EXPECT_EQ(ThrownSheet(*reduction, 33, rows), ThrownSheet(*both_ends, 33, rows)) << rows;
  }
  EXPECT_EQ(ThrownSheet(*reduction, 33, 33), ThrownSheet(*both_ends, 33, 33)) << "tiled";
}

// With subgroups, shuffles pass on the same values as barriers do. Without subgroups, the compiler
// refuses the shuffles.
TEST(StripReductionTest, ShufflesGiveTheBitsOfBarriers) {
  const auto context = gl::Context::Create({});
  ASSERT_TRUE(context.ok());
  const uint32_t shuffle_size = (*context)->limits().shuffle_size;
  const bool has_lanes = shuffle_size > 0 && shuffle_size % 32 == 0;
  const std::unique_ptr<Backend> shuffles = MakeGlBackend({.strip_solve = StripSolve::kReduction});
  const std::unique_ptr<Backend> expected = MakeGlBackend(
      {.strip_solve = has_lanes ? StripSolve::kReductionWithBarriers : StripSolve::kFromBothEnds});
  for (const uint32_t rows : {1u, 7u, 18u}) {
    for (const Direction direction : {Direction::kAtEnd, Direction::kAtStart}) {
      EXPECT_EQ(ThrownSheet(*shuffles, 30, rows, direction),
                ThrownSheet(*expected, 30, rows, direction));
    }
  }
}

// A driver that compiles everything but reduction, and one that compiles elimination alone.
TEST(StripReductionTest, AnotherWayWhereTheDeviceRefuses) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "refused_reduction";
  std::filesystem::create_directories(folder / "stages");
  for (const auto& [stage, way] : {std::pair{"lanes.glsl", StripSolve::kFromBothEnds},
                                   std::pair{"meet_strips.glsl", StripSolve::kElimination}}) {
    std::ofstream(folder / "stages" / stage) << "#error not here\n";
    const std::unique_ptr<Backend> refusing = MakeGlBackend(
        {.strip_solve = StripSolve::kReductionWithBarriers}, {.shader_dir = folder.string()});
    const std::unique_ptr<Backend> expected = MakeGlBackend({.strip_solve = way});
    for (int again = 0; again < 2; ++again) {
      EXPECT_EQ(ThrownSheet(*refusing, 16, 16), ThrownSheet(*expected, 16, 16)) << stage;
    }
  }
  std::filesystem::remove_all(folder);
}

TEST(StripReductionTest, ManySweepsAreNotCutShort) {
  const auto model = GridModel(3, 3, {0});
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.time_step_s = 0.4;
  parameters.settings.substeps = 40;
  parameters.settings.max_iterations = 100;
  parameters.settings.integration = Integration::kOneStep;
  ExpectCutsChangeNothing({.strip_solve = StripSolve::kReductionWithBarriers}, model, parameters,
                          40 * 100);
}

}  // namespace
}  // namespace drape
