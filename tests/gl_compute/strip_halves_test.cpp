// What differs on hardware: strips from both ends, the shared record, corrected roots. Properties
// of this backend only. tests/parity/strips_test.cpp tests the results.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/gl_compute/test_cloths.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

constexpr auto kFromBothEnds = StripSolve::kFromBothEnds;

// A sheet that is thrown about: its bits after two steps.
std::vector<float> ThrownAboutSheet(Backend& backend, uint32_t columns, uint32_t rows,
                                    Direction direction = Direction::kAtEnd) {
  const auto model = GridModel(columns, rows, {0, columns - 1});
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.direction = direction;
  parameters.settings.substeps = 3;
  parameters.settings.max_iterations = 2;
  ParticleState state = AtRest(*model);
  for (uint32_t i = columns; i < columns * rows; ++i) {
    state.velocities_m_per_s[i] = {std::cos(2.4 * i), 3 * std::sin(7.2 * i), std::sin(2.4 * i)};
  }
  const ClothHandle cloth = CreateCloth(backend, model, parameters, state);
  StepCloth(backend, cloth);
  StepCloth(backend, cloth);
  std::vector<float> result = ReadCloth(backend, cloth);
  backend.Destroy(cloth);
  return result;
}

// Strips of one link, that meet pins, that are divided by reduction (of more than 16 links).
TEST(StripHalvesTest, PartsListsAndRecordsDoNotChangeBits) {
  const std::unique_ptr<Backend> usual = MakeGlBackend({.strip_solve = kFromBothEnds});
  std::vector<std::unique_ptr<Backend>> others;
  others.push_back(MakeGlBackend({.loop_budget = 3000, .strip_solve = kFromBothEnds}));
  others.push_back(MakeGlBackend({.strip_solve = kFromBothEnds, .find_regular_strips = false}));
  others.push_back(MakeGlBackend({.strip_solve = kFromBothEnds, .share_record = true}));
  const std::unique_ptr<Backend> elimination =
      MakeGlBackend({.strip_solve = StripSolve::kElimination});
  for (const auto& [columns, rows] : {std::pair{2u, 9u}, {11u, 7u}, {23u, 20u}}) {
    const std::vector<float> expected = ThrownAboutSheet(*usual, columns, rows);
    EXPECT_NE(ThrownAboutSheet(*elimination, columns, rows), expected) << "not from both ends";
    for (const auto& other : others) {
      EXPECT_EQ(ThrownAboutSheet(*other, columns, rows), expected) << columns << "x" << rows;
    }
  }
}

TEST(SharedRecordTest, ItChangesNoBit) {
  const std::unique_ptr<Backend> own = MakeGlBackend({.share_record = false});
  const std::unique_ptr<Backend> shared = MakeGlBackend({.share_record = true});
  for (const Direction direction : {Direction::kAtEnd, Direction::kAtStart}) {
    EXPECT_EQ(ThrownAboutSheet(*shared, 11, 7, direction),
              ThrownAboutSheet(*own, 11, 7, direction));
  }
}

// Off by -1 to +2 ulp, as on hardware, roots and quotients of the solver give the bits of exact
// ones, however strips are solved.
TEST(RootsTest, CorrectedOnesDoNotDependOnTheDriver) {
  for (const StripSolve how : {kFromBothEnds, StripSolve::kReductionWithBarriers}) {
    const std::unique_ptr<Backend> exact = MakeGlBackend({.strip_solve = how});
    const std::unique_ptr<Backend> inexact =
        MakeGlBackend({.strip_solve = how, .correct_roots = false, .inject_root_errors = true});
    const std::unique_ptr<Backend> corrected =
        MakeGlBackend({.strip_solve = how, .correct_roots = true, .inject_root_errors = true});
    for (const auto& [columns, rows] : {std::pair{11u, 7u}, {4u, 9u}}) {
      const std::vector<float> expected = ThrownAboutSheet(*exact, columns, rows);
      EXPECT_NE(ThrownAboutSheet(*inexact, columns, rows), expected) << "no errors";
      EXPECT_EQ(ThrownAboutSheet(*corrected, columns, rows), expected);
    }
  }
}

}  // namespace
}  // namespace drape
