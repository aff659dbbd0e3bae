// A read that has begun gives the states of that moment, whatever happens to the cloths before they
// are taken.
#include <gtest/gtest.h>

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

bool AreSame(const StateColumns& a, const StateColumns& b) {
  return a.positions_m == b.positions_m && a.velocities_m_per_s == b.velocities_m_per_s;
}

// Whatever the fields, in two reads under way at a time.
void ExpectReadsOfTheirMoment(Backend& backend) {
  Scene scene = SizedCloth(33), large = SizedCloth(5000);
  scene.parameters.settings.substeps = large.parameters.settings.substeps = 2;
  const std::vector<ClothHandle> cloths{CreateCloth(backend, scene), CreateCloth(backend, large)};
  const std::vector<StepItem> items{{cloths[0], {}, false}, {cloths[1], {}, false}};
  std::vector<std::pair<StateColumns, std::unique_ptr<PendingRead>>> reads;
  for (const auto& [positions, velocities] :
       {std::pair{true, false}, {false, true}, {true, true}, {false, false}}) {
    backend.Step(items);
    const ReadRequest request{cloths, positions, velocities};
    StateColumns now = backend.Read(request);
    reads.emplace_back(std::move(now), BeginRead(backend, request));
    if (reads.size() == 1) continue;
    EXPECT_TRUE(AreSame(reads.front().second->Take(), reads.front().first));
    reads.erase(reads.begin());
  }
  reads.clear();  // the last one is never taken
  const ReadRequest request{cloths, true, true};
  StateColumns now = backend.Read(request);
  EXPECT_FALSE(std::visit([](const auto& column) { return column.empty(); }, now.positions_m));
  const auto read = BeginRead(backend, request);
  if (DeviceBackend* device = backend.device(); device != nullptr && device->RunsAhead()) {
    std::vector<StateColumns> taken;
    device->StepAhead(items, Pause::Never(), [&] { taken.push_back(read->Take()); });
    ASSERT_EQ(taken.size(), 1u);
    EXPECT_TRUE(AreSame(taken[0], now));
  } else {
    backend.Step(items);
  }
  now = backend.Read(request);
  const auto late = BeginRead(backend, request);
  ClothUpdate update;
  update.state = scene.state;
  EXPECT_TRUE(backend.Write(cloths[0], update).ok());
  for (const ClothHandle cloth : cloths) backend.Destroy(cloth);
  const ClothHandle other = CreateCloth(backend, scene);
  EXPECT_TRUE(AreSame(late->Take(), now));
  backend.Destroy(other);
}

TEST(PendingReadTest, StatesAreThoseOfTheMomentOnEveryBackend) {
  for (const std::string& name :
       {std::string("reference"), std::string("cpu"), std::string("gl")}) {
    SCOPED_TRACE(name);
    ExpectReadsOfTheirMoment(SharedBackend(name));
  }
}

// As on hardware.
TEST(PendingReadTest, StatesAreThoseOfTheMomentOnADeviceThatRunsAhead) {
  GlTuning tuning;
  tuning.runs_ahead = true;
  Result<std::unique_ptr<Backend>> backend = CreateTunedGlBackend({}, tuning);
  ASSERT_TRUE(backend.ok()) << backend.status().ToString();
  EXPECT_TRUE((*backend)->device()->RunsAhead());
  ExpectReadsOfTheirMoment(**backend);
}

}  // namespace
}  // namespace drape::test
