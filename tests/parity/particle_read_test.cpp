// A read of some particles gives the rows that they have in the read of whole cloths, on every
// backend.
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/solver/device_backend.h"
#include "server/solver/gl_compute/gl_tuning.h"
#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using List = std::vector<uint32_t>;

// Every `stride`th particle of `count`.
List EveryOf(uint32_t count, uint32_t stride) {
  List particles;
  for (uint32_t p = 0; p < count; p += stride) particles.push_back(p);
  return particles;
}

// The rows of `particles` of each cloth in a column of whole cloths of this many particles.
ScalarColumn RowsIn(const ScalarColumn& whole, const List& counts, const List& particles) {
  return std::visit(
      [&](const auto& values) -> ScalarColumn {
        std::decay_t<decltype(values)> rows;
        size_t begin = 0;
        for (const uint32_t count : counts) {
          for (const uint32_t particle : particles) {
            if (values.empty()) break;
            const auto row = values.begin() + static_cast<ptrdiff_t>(3 * (begin + particle));
            rows.insert(rows.end(), row, row + 3);
          }
          begin += count;
        }
        return rows;
      },
      whole);
}

constexpr std::array<std::pair<bool, bool>, 3> kFields = {
    {{true, false}, {false, true}, {true, true}}};

// Cloths that have been stepped, so that no two rows are equal.
class ParticleRead {
 public:
  ParticleRead(Backend& backend, List counts) : backend_(backend), counts_(std::move(counts)) {
    for (const uint32_t count : counts_) {
      Scene scene = SizedCloth(count);
      scene.parameters.settings.substeps = 2;
      cloths_.push_back(CreateCloth(backend, scene));
    }
    Step();
  }
  ~ParticleRead() {
    for (const ClothHandle cloth : cloths_) backend_.Destroy(cloth);
  }
  ParticleRead(const ParticleRead&) = delete;
  ParticleRead& operator=(const ParticleRead&) = delete;

  void Step() {
    std::vector<StepItem> items;
    for (const ClothHandle cloth : cloths_) items.push_back({cloth, {}, false});
    backend_.Step(items);
  }

  StateColumns Expected(const List& particles, bool positions, bool velocities) {
    const StateColumns whole = backend_.Read({cloths_, positions, velocities});
    return {RowsIn(whole.positions_m, counts_, particles),
            RowsIn(whole.velocities_m_per_s, counts_, particles)};
  }
  ReadRequest Request(const List& particles, bool positions, bool velocities) const {
    return {cloths_, positions, velocities, particles};
  }

  void ExpectRowsOf(const List& particles) {
    for (const auto& [positions, velocities] : kFields) {
      SCOPED_TRACE(std::to_string(particles.size()) + " particles, fields " +
                   std::to_string(positions) + std::to_string(velocities));
      const StateColumns expected = Expected(particles, positions, velocities);
      const StateColumns read = backend_.Read(Request(particles, positions, velocities));
      // By ==, not EXPECT_EQ, which would print thousands of numbers.
      EXPECT_TRUE(read.positions_m == expected.positions_m);
      EXPECT_TRUE(read.velocities_m_per_s == expected.velocities_m_per_s);
    }
  }

  // A read that has begun does not depend on later changes of the list and the cloths.
  void ExpectPendingRowsOf(List particles) {
    const StateColumns expected = Expected(particles, true, true);
    const auto read = BeginRead(backend_, Request(particles, true, true));
    const StateColumns before = backend_.Read({cloths_, true, false});
    particles.assign(particles.size(), 0);
    Step();
    EXPECT_FALSE(backend_.Read({cloths_, true, false}).positions_m == before.positions_m);
    const StateColumns taken = read->Take();
    EXPECT_TRUE(taken.positions_m == expected.positions_m);
    EXPECT_TRUE(taken.velocities_m_per_s == expected.velocities_m_per_s);
  }

 private:
  Backend& backend_;
  const List counts_;
  std::vector<ClothHandle> cloths_;
};

// Ends, runs, single ones, all of the smallest cloth.
const std::vector<List> kLists = {
    {0}, {32}, {0, 32}, {0, 1, 2}, {3, 4, 5, 9, 20, 21, 32}, EveryOf(33, 2), EveryOf(33, 1)};

void ExpectRows(Backend& backend) {
  ParticleRead several(backend, {33, 5000, 1024, 33});
  for (const List& particles : kLists) {
    several.ExpectRowsOf(particles);
    several.ExpectPendingRowsOf(particles);
  }
  ParticleRead one(backend, {5000});
  for (const List& particles : {EveryOf(5000, 4999), EveryOf(5000, 3), EveryOf(5000, 1)}) {
    one.ExpectRowsOf(particles);
    one.ExpectPendingRowsOf(particles);
  }
}

TEST(ParticleReadTest, RowsAreThoseOfTheWholeReadOnEveryBackend) {
  for (const std::string& name :
       {std::string("reference"), std::string("cpu"), std::string("gl")}) {
    SCOPED_TRACE(name);
    ExpectRows(SharedBackend(name));
  }
}

// As on hardware.
TEST(ParticleReadTest, RowsAreThoseOfTheWholeReadOnADeviceThatRunsAhead) {
  GlTuning tuning;
  tuning.runs_ahead = true;
  Result<std::unique_ptr<Backend>> backend = CreateTunedGlBackend({}, tuning);
  ASSERT_TRUE(backend.ok()) << backend.status().ToString();
  ExpectRows(**backend);
}

// More runs than the device packs at once: 2 x 8 x 2500.
TEST(ParticleReadTest, ThousandsOfSingleParticlesOfSeveralCloths) {
  for (const std::string& name : {std::string("cpu"), std::string("gl")}) {
    SCOPED_TRACE(name);
    ParticleRead cloths(SharedBackend(name), List(8, 5000));
    cloths.ExpectRowsOf(EveryOf(5000, 2));
    cloths.ExpectPendingRowsOf(EveryOf(5000, 2));
  }
}

}  // namespace
}  // namespace drape::test
