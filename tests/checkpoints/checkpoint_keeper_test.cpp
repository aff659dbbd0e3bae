// Checkpoints that meet changes of more cloths than one command takes.
#include "server/checkpoints/checkpoint_keeper.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "server/session/sliced_command.h"
#include "tests/session/session_fixture.h"

namespace drape {
namespace {

using Eigen::Vector3d;

// Two slices and a part.
constexpr size_t kCloths = 2 * kSliceCloths + 100;

class CheckpointKeeperTest : public SessionFixture {
 protected:
  CheckpointKeeperTest() {
    Start();
    cloths_ = Find(Create(Chains(kCloths, 2)).value().ids);
    folder_ = std::filesystem::path(testing::TempDir()) / ("keeper." + std::to_string(getpid()));
    std::filesystem::remove_all(folder_);
    keeper_ = Keeper(*registry_);
    EXPECT_TRUE(keeper_->Start().ok());
    name_ = session().name();
  }
  ~CheckpointKeeperTest() override {
    keeper_ = nullptr;
    std::filesystem::remove_all(folder_);
  }

  // That never writes by itself.
  std::unique_ptr<CheckpointKeeper> Keeper(SessionRegistry& registry) {
    return std::make_unique<CheckpointKeeper>(
        CheckpointOptions{folder_.string(), 1e6, max_expired_bytes_}, registry, *scheduler_,
        api::RequestLimits{}, "1", "run");
  }
  // Sessions of a chain of 2 particles, each with a checkpoint before.
  void Expire(const std::string& tenant, int sessions) {
    for (int k = 0; k < sessions; ++k) {
      const SessionLease session = registry_->Create(kMinTtl_s, "", tenant).value();
      ASSERT_TRUE(Create(*session, Chains(1, 2)).ok());
    }
    ASSERT_TRUE(keeper_->WriteRound().ok());
    clock_.AdvanceUs(static_cast<int64_t>((kMinTtl_s + 1) * 1e6));
    registry_->ReapExpired();
  }
  size_t FilesIn(const std::filesystem::path& folder, const std::string& extension) {
    const std::filesystem::directory_iterator files(folder);
    return static_cast<size_t>(std::count_if(begin(files), end(files), [&](const auto& entry) {
      return entry.path().extension() == extension;
    }));
  }

  // A checkpoint that is asked for now, on the device thread, before this returns.
  void BeginCheckpoint() {
    const uint32_t before = scheduler_->counters().queued_commands;
    written_ = std::async(std::launch::async, [this] { return keeper_->WriteRound(); });
    while (scheduler_->counters().queued_commands == before) std::this_thread::yield();
  }

  // The gravities along z that a server finds which begins with the files.
  std::set<double> Recovered() {
    EXPECT_TRUE(written_.get().ok());
    keeper_ = nullptr;
    SessionRegistry registry(*scheduler_, {}, clock_, "server8");
    const auto keeper = Keeper(registry);
    EXPECT_TRUE(keeper->Start().ok());
    const SessionLease session = registry.Find(name_).value();
    std::set<double> found;
    const ClothList cloths = session->FindCloths({}).value();
    EXPECT_EQ(cloths.size(), kCloths);
    for (const auto& cloth : cloths) {
      found.insert(cloth->description()->parameters.gravity_m_per_s2.z());
    }
    return found;
  }

  ClothList cloths_;
  std::filesystem::path folder_;
  uint64_t max_expired_bytes_ = uint64_t{1} << 30;
  std::unique_ptr<CheckpointKeeper> keeper_;
  std::future<Status> written_;
  std::string name_;
};

ClothChange Gravity(double z) {
  ClothChange change;
  change.gravity_m_per_s2 = Vector3d(0, 0, z);
  return change;
}

TEST_F(CheckpointKeeperTest, HoldsNoHalfOfAnUpdateThatIsUnderWay) {
  const size_t begin = device_->writes();
  device_->OnWrite([this, begin](size_t nth) {
    if (nth == begin + kSliceCloths + 1) BeginCheckpoint();  // in the second slice
  });
  EXPECT_TRUE(Update(cloths_, Gravity(-1)).ok());
  EXPECT_EQ(Recovered(), std::set<double>{-1});
}

TEST_F(CheckpointKeeperTest, NoUpdateComesBetweenItsSlices) {
  Awaited<Result<UpdatedCloths>> updated;
  bool has_begun = false;
  device_->OnRead([&, this](size_t) {
    if (std::exchange(has_begun, true)) return;  // in the first slice
    updated = BeginUpdate(cloths_, Gravity(-1));
  });
  written_ = std::async(std::launch::async, [this] { return keeper_->WriteRound(); });
  EXPECT_TRUE(written_.valid());
  const std::set<double> found = Recovered();
  EXPECT_EQ(found, std::set<double>{0});
  EXPECT_TRUE(updated.Get().ok());
}

TEST_F(CheckpointKeeperTest, ComesBeforeTheCommandsThatWait) {
  size_t done = 0, done_before = 100;
  scheduler_->HoldForTest();
  for (int k = 0; k < 10; ++k) {
    ASSERT_TRUE(scheduler_->Post(session().owner(), [&](Backend&) { ++done; }).ok());
  }
  device_->OnRead([&](size_t) { done_before = std::min(done, done_before); });
  BeginCheckpoint();
  scheduler_->ReleaseForTest();
  EXPECT_EQ(Recovered(), std::set<double>{0});
  EXPECT_EQ(done_before, 0u);
  EXPECT_EQ(done, 10u);
}

TEST_F(CheckpointKeeperTest, KeepsTheExpiredSessionsOfEachTenant) {
  const auto kept = [this] { return FilesIn(folder_ / "expired", ".snapshot"); };
  Expire("bob", 1);
  EXPECT_EQ(kept(), 1u);
  Expire("alice", 70);
  EXPECT_EQ(kept(), 1u + 64) << "the newest of Alice, and Bob's";
  EXPECT_EQ(FilesIn(folder_, ".checkpoint"), 1u) << "of the session that lives";
}

// It must not fill the disk, nor come back with a whole lease.
TEST_F(CheckpointKeeperTest, AnExpiredSessionThatCannotBeKeptLeavesNoCheckpoint) {
  std::filesystem::remove_all(folder_ / "expired");
  std::ofstream(folder_ / "expired") << "no folder";
  Expire("alice", 3);
  EXPECT_EQ(FilesIn(folder_, ".checkpoint"), 1u);
  std::filesystem::remove(folder_ / "expired");
  keeper_ = nullptr;
  SessionRegistry registry(*scheduler_, {}, clock_, "server8");
  keeper_ = Keeper(registry);
  EXPECT_TRUE(keeper_->Start().ok());
  EXPECT_EQ(registry.All().size(), 1u);
  keeper_ = nullptr;
}

TEST_F(CheckpointKeeperTest, AnExpiredSessionLargerThanItsTenantMayHaveIsNotKept) {
  keeper_ = nullptr;
  std::filesystem::remove_all(folder_);
  max_expired_bytes_ = 100;
  keeper_ = Keeper(*registry_);
  ASSERT_TRUE(keeper_->Start().ok());
  Expire("alice", 1);
  EXPECT_EQ(FilesIn(folder_ / "expired", ".snapshot"), 0u);
  EXPECT_EQ(FilesIn(folder_, ".checkpoint"), 1u);
}

// What a crash may lose: from the moment that a round sees to the end of the next one.
TEST(PauseAfterRound, LosesNoMoreThanAnIntervalWhereARoundTakesUpToAQuarterOfIt) {
  for (const double interval_s : {0.1, 1.0, 60.0, 86400.0}) {
    for (const double part : {0.0, 0.001, 0.1, 0.2, 0.25}) {
      const double round_s = part * interval_s;
      const double pause_s = PauseAfterRound_s(interval_s, round_s);
      EXPECT_LE(round_s + pause_s + 2 * round_s, interval_s * (1 + 1e-12))
          << "the next takes twice";
      EXPECT_GE(pause_s, 0.25 * interval_s);
    }
    // Slow disks have at least as much rest, up to an interval.
    EXPECT_EQ(PauseAfterRound_s(interval_s, interval_s / 2), interval_s / 2);
    EXPECT_EQ(PauseAfterRound_s(interval_s, 5 * interval_s), interval_s);
  }
}

}  // namespace
}  // namespace drape
