#include "server/scene/strips.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "server/scene/scene_model.h"
#include "tests/support/obj_file.h"
#include "tests/support/paths/paths.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
using ::testing::ElementsAre;
using ::testing::SizeIs;

std::shared_ptr<const SceneModel> GridModel(uint32_t columns, uint32_t rows,
                                            std::vector<uint32_t> pins = {}) {
  ModelDescription description;
  description.topology = GridTopology{columns, rows, 0.1 * columns, 0.1 * rows};
  description.pinned_particles = std::move(pins);
  return SceneModel::Build(description).value();
}

std::shared_ptr<const SceneModel> Model(Topology topology, std::vector<uint32_t> pins = {}) {
  auto model = SceneModel::Build({std::move(topology), {}, std::move(pins)});
  if (!model.ok()) throw std::runtime_error(model.status().message());
  return model.value();
}

// Every constraint in one strip of the phases there, links between neighbours of the path, nothing
// twice in a strip, and no free particle in two strips of a phase.
void ExpectValid(const SceneModel& model) {
  const StripSet& strips = model.strips();
  std::vector<int> uses(model.constraint_count(), 0);
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    std::set<uint32_t> written;
    for (uint32_t s = strips.phase_offsets[phase]; s < strips.phase_offsets[phase + 1]; ++s) {
      std::set<uint32_t> visited{strips.particles[strips.strip_offsets[s] + s]};
      for (uint32_t k = strips.strip_offsets[s]; k < strips.strip_offsets[s + 1]; ++k) {
        const DistanceConstraint& c = model.constraints()[strips.constraints[k]];
        if (phase < strips.phase_count_there) ++uses[strips.constraints[k]];
        const uint32_t a = strips.particles[k + s], b = strips.particles[k + s + 1];
        EXPECT_EQ(std::minmax(a, b), std::minmax(c.i, c.j));
        EXPECT_TRUE(visited.insert(b).second) << "strip " << s << " visits " << b << " twice";
      }
      for (const uint32_t p : visited) {
        if (model.inverse_masses_per_kg()[p] == 0) continue;
        EXPECT_TRUE(written.insert(p).second) << "phase " << phase << " writes " << p << " twice";
      }
    }
  }
  EXPECT_TRUE(std::ranges::all_of(uses, [](int n) { return n == 1; }));
}

TEST(FindStrips, OfAGridAreItsRowsAndColumns) {
  for (const auto& [columns, rows] : {std::pair{8u, 8u}, {45u, 27u}, {27u, 45u}, {5u, 1u}}) {
    const auto model = GridModel(columns, rows, {0, columns - 1});
    ExpectValid(*model);
    const StripSet& strips = model->strips();
    EXPECT_EQ(strips.phase_count(), rows > 1 ? 2u : 1u);
    EXPECT_EQ(strips.strip_count(), rows > 1 ? rows + columns : 1u);
  }
}

TEST(FindStrips, OfAChainIsTheChainWhateverItsShapeAndTheOrderOfItsLinks) {
  ParticleTopology chain;
  const std::vector<Vector3d> zigzag{{0, 0, 0}, {1, 0, 0}, {0, 0.1, 0}, {1, 0.1, 0}, {2, 0, 0}};
  chain.positions_m = zigzag;
  chain.masses_kg.assign(5, 1.0);
  chain.distance_constraints = {{3, 4, 1, 0}, {1, 0, 1, 0}, {2, 3, 1, 0}, {2, 1, 1, 0}};
  const auto model = Model(chain, {0});
  ExpectValid(*model);
  EXPECT_EQ(model->strips().strip_count(), 1u);
  EXPECT_THAT(model->strips().constraints, SizeIs(4));
}

TEST(FindStrips, CutsRingsAndLongPaths) {
  ParticleTopology ring;
  const uint32_t count = 3 * kMaxStripLinks;
  for (uint32_t k = 0; k < count; ++k) {
    const double angle = 2 * M_PI * k / count;
    ring.positions_m.emplace_back(std::cos(angle), std::sin(angle), 0);
    ring.distance_constraints.push_back({k, (k + 1) % count, 2 * M_PI / count, 0});
  }
  ring.masses_kg.assign(count, 1.0);
  const auto model = Model(ring);
  ExpectValid(*model);
  const StripSet& strips = model->strips();
  for (uint32_t s = 0; s < strips.strip_count(); ++s) {
    EXPECT_LE(strips.strip_offsets[s + 1] - strips.strip_offsets[s], kMaxStripLinks);
  }
  EXPECT_LE(strips.strip_count(), 5u);
}

// A star has no straight ways on; its hub is in every strip, so each is a phase of its own.
TEST(HangsByStrips, IfEachParticleHasOnePinInItsRowOrColumn) {
  EXPECT_TRUE(GridModel(4, 3, {0, 1, 2, 3})->hangs_by_strips()) << "a row";
  EXPECT_TRUE(GridModel(4, 3, {1, 5, 9})->hangs_by_strips()) << "a column";
  EXPECT_FALSE(GridModel(4, 3, {0, 3})->hangs_by_strips()) << "two corners";
  EXPECT_FALSE(GridModel(4, 3)->hangs_by_strips());
  EXPECT_TRUE(GridModel(6, 1, {3})->hangs_by_strips()) << "a chain by one in its middle";
  EXPECT_FALSE(GridModel(6, 1, {0, 5})->hangs_by_strips()) << "a chain by both ends";
  EXPECT_FALSE(GridModel(4, 3, {0, 1, 2, 3, 8, 9, 10, 11})->hangs_by_strips()) << "two rows";
}

TEST(FindSpans, AreTheStripsWithTwoPins) {
  EXPECT_FALSE(GridModel(5, 4)->has_spans());
  EXPECT_FALSE(GridModel(5, 4, {0, 6})->has_spans()) << "neither in a row nor in a column";
  const auto model = GridModel(5, 4, {1, 4, 11});  // of the first row and of the second column
  uint32_t spans = 0;
  for (uint32_t s = 0; s < model->strips().strip_count(); ++s) spans += model->IsSpan(s);
  EXPECT_EQ(spans, 2u);
}

TEST(FindStrips, OfAStarAreItsEdges) {
  ParticleTopology star;
  star.positions_m.emplace_back(0, 0, 0);
  for (uint32_t k = 0; k < 40; ++k) {
    star.positions_m.emplace_back(std::cos(0.1 * k), std::sin(0.1 * k), 0);
    star.distance_constraints.push_back({0, k + 1, 1, 0});
  }
  star.masses_kg.assign(41, 1.0);
  const auto model = Model(star);
  ExpectValid(*model);
  EXPECT_EQ(model->strips().phase_count_there, 40u);
  EXPECT_EQ(model->strips().phase_count(), 79u) << "there and back";
}

// The constraints of each phase.
std::vector<std::set<uint32_t>> PhasesOf(const StripSet& strips) {
  std::vector<std::set<uint32_t>> phases;
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    const auto at = [&](uint32_t s) {
      return strips.constraints.begin() + strips.strip_offsets[s];
    };
    phases.emplace_back(at(strips.phase_offsets[phase]), at(strips.phase_offsets[phase + 1]));
  }
  return phases;
}

// Its six links make three phases of two that share no particle.
ParticleTopology Tetrahedron() {
  ParticleTopology tetrahedron;
  tetrahedron.positions_m = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  tetrahedron.masses_kg.assign(4, 1.0);
  for (uint32_t i = 0; i < 4; ++i) {
    for (uint32_t j = 0; j < i; ++j) {
      tetrahedron.distance_constraints.push_back({j, i, std::sqrt(8.0), 0});
    }
  }
  return tetrahedron;
}

TEST(AddWaysBack, GoesBackThroughAllPhasesButTheLast) {
  const auto model = Model(Tetrahedron());
  ExpectValid(*model);
  const auto phases = PhasesOf(model->strips());
  ASSERT_EQ(model->strips().phase_count_there, 3u);
  ASSERT_THAT(phases, SizeIs(5));
  EXPECT_EQ(phases[3], phases[1]);
  EXPECT_EQ(phases[4], phases[0]);

  StripSet twice = model->strips();
  AddWaysBack(1, twice);
  EXPECT_EQ(twice.phase_count(), 7u) << "a second time, onto those that are there";
}

TEST(WaysBack, AreNeededByThreePhasesOfRigidLinks) {
  ParticleTopology solid = Tetrahedron();
  EXPECT_EQ(Model(solid)->strips().phase_count(), 5u);
  for (DistanceConstraint& link : solid.distance_constraints) link.compliance_m_per_n = 1e-3;
  EXPECT_EQ(Model(solid)->strips().phase_count(), 3u);
  EXPECT_EQ(GridModel(8, 8)->strips().phase_count(), 2u);
}

// A chain of these masses.
std::shared_ptr<const SceneModel> ChainOf(std::vector<double> masses_kg,
                                          std::vector<uint32_t> pins = {}) {
  ParticleTopology chain;
  for (uint32_t k = 0; k < masses_kg.size(); ++k) {
    chain.positions_m.emplace_back(k, 0, 0);
    if (k > 0) chain.distance_constraints.push_back({k - 1, k, 1, 0});
  }
  chain.masses_kg = std::move(masses_kg);
  return Model(chain, std::move(pins));
}

TEST(WaysBack, AreTwoWhereAParticleBetweenHeavyOnesWhips) {
  EXPECT_EQ(ChainOf({11.1, 1, 11.1})->strips().phase_count(), 3u);
  EXPECT_EQ(ChainOf({11.1, 1, 9.9})->strips().phase_count(), 1u);
  EXPECT_EQ(ChainOf({1, 11.1, 1})->strips().phase_count(), 1u) << "heavy between light ones";
  EXPECT_EQ(ChainOf({1, 1, 11.1}, {0})->strips().phase_count(), 3u) << "a pin has no mass";
  EXPECT_EQ(ChainOf({1, 1, 1}, {0, 2})->strips().phase_count(), 1u) << "between pins";
}

TEST(FindStrips, OfAGarmentJoinMostOfItsEdges) {
  const auto model = Model(ReadObj(SourcePath("client/examples/meshes/skirt.obj"), 1.0));
  ExpectValid(*model);
  const StripSet& strips = model->strips();
  uint32_t joined = 0;
  for (uint32_t s = 0; s < strips.strip_count(); ++s) {
    const uint32_t links = strips.strip_offsets[s + 1] - strips.strip_offsets[s];
    if (links > 1) joined += links;
  }
  RecordProperty("phases", static_cast<int>(strips.phase_count()));
  RecordProperty("joined_percent", static_cast<int>(100 * joined / model->constraint_count()));
  EXPECT_GT(joined, 0.9 * model->constraint_count());
  EXPECT_LT(strips.phase_count_there, 2 * model->colour_count());
}

}  // namespace
}  // namespace drape::test
